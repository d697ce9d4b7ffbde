#include "pipeline/pictures/normal_pictures.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace atelier {
namespace {

/// A square of 2 m in front of a camera at the origin that looks along +Z, turned about Y.
PaintedScene square_scene(double degrees, bool turned_over = false) {
  const double angle = degrees * std::numbers::pi / 180;
  PaintedScene scene;
  SceneLayer layer;
  layer.name = "cloth";
  layer.faces.resize(2, 3);
  layer.faces << 0, 1, 2, 0, 2, 3;
  if (turned_over) {
    layer.faces.col(1).swap(layer.faces.col(2));
  }
  Points vertices(4, 3);
  vertices << -1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0;
  for (Index v = 0; v < 4; ++v) {
    const double x = vertices(v, 0);
    vertices.row(v) << std::cos(angle) * x, vertices(v, 1), 4 - std::sin(angle) * x;
  }
  scene.layers = {layer};
  scene.vertices.push_back({vertices});
  scene.frame_ids = {7};
  Camera camera;
  camera.width = camera.height = 40;
  camera.fx = camera.fy = 40;
  camera.cx = camera.cy = 20;
  scene.cameras = {camera};
  return scene;
}

ByteImage drawn(const PaintedScene& scene, const PaintOptions& options = {}) {
  std::vector<Image> pictures;
  PaintHooks hooks;
  hooks.picture = [&](Index, const Image& picture) { pictures.push_back(picture); };
  EXPECT_TRUE(draw_normals(scene, options, hooks));
  EXPECT_EQ(pictures.size(), scene.frame_ids.size());
  return srgb_from_linear(pictures.at(0));
}

void expect_color(const ByteImage& image, int x, int y, double r, double g, double b) {
  const double wanted[3] = {r, g, b};
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(image.at(x, y, c), 255 * (1 + wanted[c]) / 2, 1) << c;
  }
}

TEST(NormalPictures, SurfaceThatFacesTheCamera_IsBlueOnBothSides) {
  expect_color(drawn(square_scene(0)), 20, 20, 0, 0, 1);
  expect_color(drawn(square_scene(0, true)), 20, 20, 0, 0, 1);
}

TEST(NormalPictures, SurfaceTurnedToTheRight_IsRed) {
  const double half = std::sqrt(0.5);
  expect_color(drawn(square_scene(45)), 20, 20, -half, 0, half);
  expect_color(drawn(square_scene(-45)), 20, 20, half, 0, half);
}

TEST(NormalPictures, BesideTheSurface_IsBackgroundOrNothing) {
  PaintOptions options;
  options.background = {1, 0, 0};
  const ByteImage before = drawn(square_scene(0), options);
  EXPECT_EQ(before.at(1, 1, 0), 255);
  EXPECT_EQ(before.at(1, 1, 1), 0);
  EXPECT_EQ(before.at(1, 1, 3), 255);
  options.alpha = true;
  const ByteImage alone = drawn(square_scene(0), options);
  EXPECT_EQ(alone.at(1, 1, 3), 0);
  EXPECT_EQ(alone.at(20, 20, 3), 255);
}

TEST(NormalPictures, Stop_EndsBeforeTheNextFrame) {
  int count = 0;
  PaintHooks hooks;
  hooks.picture = [&](Index, const Image&) { ++count; };
  hooks.stop = [] { return true; };
  EXPECT_FALSE(draw_normals(square_scene(0), {}, hooks));
  EXPECT_EQ(count, 0);
}

}  // namespace
}  // namespace atelier
