#include "core/render/framing.h"

#include <limits>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/options.h"
#include "core/render/render.h"
#include "core/render/studio.h"
#include "core/render/video.h"
#include "tests/core_render/shapes.h"

namespace atelier {
namespace {

using fixtures::sphere;

TEST(Framing, EveryPoint_LiesInsideTheMargin) {
  const Points points =
      sphere(12, 24, 1, {3, 1, -2}).vertices * Eigen::Vector3d(1, 2, 0.5).asDiagonal();
  for (const View& view : {kFront, kThreeQuarter, kSide, kBack, View{2, 1.5}, View{0, -1.2}}) {
    const Camera camera = camera_around(points, view, 300, 400, {.margin = 0.1});
    check_camera(camera);
    double border = 1e9;
    for (Index i = 0; i < points.rows(); ++i) {
      const auto pixel = project(camera, points.row(i));
      ASSERT_TRUE(pixel);
      border = std::min(
          {border, pixel->x() / 300, 1 - pixel->x() / 300, pixel->y() / 400, 1 - pixel->y() / 400});
    }
    EXPECT_NEAR(border, 0.1, 1e-6) << view.azimuth << " " << view.elevation;
  }
}

TEST(Framing, NamedViews_LookFromTheirSide) {
  const Points points = sphere(6, 8).vertices;
  EXPECT_GT(camera_center(camera_around(points, kFront, 100, 100)).z(), 1);
  EXPECT_LT(camera_center(camera_around(points, kBack, 100, 100)).z(), -1);
  EXPECT_GT(camera_center(camera_around(points, kSide, 100, 100)).x(), 1);
  EXPECT_GT(camera_center(camera_around(points, {0, 1.5}, 100, 100)).y(), 1);
}

TEST(Framing, WorldUp_IsImageUp) {
  const Camera camera = camera_around(sphere(6, 8).vertices, kThreeQuarter, 100, 100);
  EXPECT_LT(project(camera, {0, 0.5, 0})->y(), project(camera, {0, -0.5, 0})->y());
}

TEST(Framing, Turntable_KeepsDistanceAndFramesAllPoints) {
  const Points points = sphere(6, 8, 1, {1, 2, 3}).vertices * Eigen::Vector3d(3, 1, 1).asDiagonal();
  const auto cameras = turntable_cameras(points, kFront, 12, 100, 100);
  ASSERT_EQ(cameras.size(), 12u);
  const Eigen::Vector3d low = points.colwise().minCoeff();
  const Eigen::Vector3d high = points.colwise().maxCoeff();
  const Eigen::Vector3d middle = 0.5 * (low + high);
  const double distance = (camera_center(cameras[0]) - middle).norm();
  for (const Camera& camera : cameras) {
    EXPECT_NEAR((camera_center(camera) - middle).norm(), distance, 1e-9);
    for (Index i = 0; i < points.rows(); ++i) {
      const auto pixel = project(camera, points.row(i));
      ASSERT_TRUE(pixel);
      EXPECT_GE(pixel->x(), 0);
      EXPECT_LE(pixel->x(), 100);
    }
  }
}

TEST(Framing, SinglePoint_IsFramed) {
  const Camera camera = camera_around(Points::Zero(1, 3), kFront, 10, 10);
  EXPECT_NO_THROW(check_camera(camera));
}

TEST(FramingRefusal, BadPointsOrOptions_Throw) {
  const Points points = sphere(6, 8).vertices;
  EXPECT_THROW(camera_around(Points(0, 3), kFront, 10, 10), LogicError);
  EXPECT_THROW(camera_around(points, kFront, 0, 10), LogicError);
  EXPECT_THROW(camera_around(points, kFront, 10, 10, {.field_of_view = 0}), LogicError);
  EXPECT_THROW(camera_around(points, kFront, 10, 10, {.field_of_view = 3.2}), LogicError);
  EXPECT_THROW(camera_around(points, kFront, 10, 10, {.margin = 0.5}), LogicError);
  EXPECT_THROW(turntable_cameras(points, kFront, 0, 10, 10), LogicError);
  Points bad = points;
  bad(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(camera_around(bad, kFront, 10, 10), LogicError);
}

TEST(Studio, SphereFromAllSides_LooksAlike) {
  const auto pictures = turntable_of({{sphere(24, 48), clay_look()}}, 3, kFront, {48, 48, 4, {}});
  ASSERT_EQ(pictures.size(), 3u);
  for (std::size_t p = 1; p < 3; ++p) {
    double difference = 0;
    for (std::size_t i = 0; i < pictures[0].data.size(); ++i) {
      difference += std::abs(pictures[p].data[i] - pictures[0].data[i]);
    }
    EXPECT_LT(difference / static_cast<double>(pictures[0].data.size()), 0.01);
  }
}

TEST(Studio, ClaySphere_IsNeitherBurntNorBlack) {
  const Image picture = picture_of(sphere(24, 48), kFront, {64, 64, 8, {}});
  float brightest = 0, darkest = 1;
  for (int y = 16; y < 48; ++y) {
    for (int x = 16; x < 48; ++x) {
      brightest = std::max(brightest, picture.at(x, y));
      darkest = std::min(darkest, picture.at(x, y));
    }
  }
  EXPECT_LT(brightest, 0.95f);
  EXPECT_GT(brightest, 0.4f);
  EXPECT_GT(darkest, 0.02f);
}

TEST(Studio, SceneScale_DoesNotChangeTheImage) {
  const PictureOptions options{40, 40, 4, {}};
  const Image metres = picture_of(sphere(12, 24, 1), kFront, options);
  const Image large = picture_of(sphere(12, 24, 100), kFront, options);
  double difference = 0;
  for (std::size_t i = 0; i < metres.data.size(); ++i) {
    difference += std::abs(metres.data[i] - large.data[i]);
  }
  EXPECT_LT(difference / static_cast<double>(metres.data.size()), 2e-3);
}

TEST(Studio, NoMesh_ShowsTheEmptyStudio) {
  const Image picture = picture_of(std::vector<RenderMesh>{}, kFront, {20, 20, 1, {}});
  EXPECT_GT(picture.at(10, 10), 0.1f);
}

std::string refusal(const Mesh& mesh) {
  try {
    picture_of(mesh, kFront, {20, 20, 1, {}});
  } catch (const DataError& error) {
    return error.what();
  }
  return "was shown";
}

TEST(Studio, InvisibleMesh_SaysWhatIsMissing) {
  Mesh mesh = sphere(6, 8);
  EXPECT_EQ(refusal(Mesh{}).find("the mesh has no faces"), 0u);
  mesh.vertices.setConstant(0.25);
  EXPECT_EQ(refusal(mesh).find("the mesh has no extent"), 0u);
  EXPECT_THROW(studio_scene({{mesh, clay_look()}}), DataError);
  EXPECT_THROW(turntable_of({{mesh, clay_look()}}, 2), DataError);
  mesh.faces.resize(0, 3);
  EXPECT_EQ(refusal(mesh).find("the mesh has no faces"), 0u);
}

TEST(Studio, MeshBesidePointCloud_IsShown) {
  Mesh points = sphere(6, 8);
  points.faces.resize(0, 3);
  EXPECT_EQ(studio_scene({{sphere(6, 8), clay_look()}, {points, clay_look()}}).meshes.size(), 2u);
}

TEST(Studio, NonFiniteAzimuth_IsRefused) {
  EXPECT_THROW(studio_scene({}, std::numeric_limits<double>::infinity()), LogicError);
}

TEST(RenderOptions, OptionTable_DescribesEveryField) {
  RenderOptions options;
  OptionTable table = describe(options);
  EXPECT_EQ(table.fields.size(), 6u);
  EXPECT_TRUE(check_options(table).empty());
  EXPECT_EQ(set_option(table, "samples", "32"), "");
  EXPECT_EQ(options.samples, 32);
  EXPECT_NE(set_option(table, "samples", "0"), "");
  EXPECT_NE(set_option(table, "samplse", "4").find("samples"), std::string::npos);
}

TEST(PictureOptions, Defaults_LieWithinTheirRanges) {
  PictureOptions picture;
  PrepareOptions prepare_options;
  VideoOptions video;
  EXPECT_TRUE(check_options(describe(picture)).empty());
  EXPECT_TRUE(check_options(describe(prepare_options)).empty());
  EXPECT_TRUE(check_options(describe(video)).empty());
  OptionTable table = describe(picture);
  EXPECT_EQ(set_option(table, "framing.margin", "0.2"), "");
  EXPECT_EQ(picture.framing.margin, 0.2);
  EXPECT_NE(set_option(table, "framing.margin", "0.6"), "");
  EXPECT_NE(set_option(table, "width", "0"), "");
}

}  // namespace
}  // namespace atelier
