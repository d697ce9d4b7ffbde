#include "appearance/geometry_maps.h"

#include <Eigen/Geometry>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/occlusion.h"
#include "appearance/visible_pixels.h"
#include "core/error.h"
#include "core/parallel.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// The plane y = 0 over [0,1]^2 with u along x and v against z.
Mesh sheet() {
  Mesh mesh = testing::grid(4, 4);
  mesh.uvs.resize(mesh.vertices.rows(), 2);
  mesh.uvs.col(0) = mesh.vertices.col(0);
  mesh.uvs.col(1) = 1 - mesh.vertices.col(2).array();
  mesh.uv_faces = mesh.faces;
  return mesh;
}

struct Mapped {
  TexelMap texels;
  GeometryMaps maps;
};

Mapped mapped(const Mesh& mesh, int resolution) {
  Mapped result;
  result.texels = texel_map(mesh.faces, mesh.uvs, mesh.uv_faces, resolution);
  result.maps = geometry_maps(mesh.vertices, mesh.faces, mesh.uvs, mesh.uv_faces, result.texels);
  return result;
}

TEST(GeometryMaps, PositionNormalAndTangentOfAPlane) {
  const auto [texels, maps] = mapped(sheet(), 16);
  ASSERT_EQ(maps.position.rows(), 256);
  for (Index i = 0; i < 256; ++i) {
    const int texel = texels.covered[static_cast<std::size_t>(i)];
    const Eigen::RowVector3f place((texel % 16 + 0.5F) / 16, 0, (texel / 16 + 0.5F) / 16);
    EXPECT_LT((maps.position.row(i) - place).norm(), 1e-3F);
    EXPECT_LT((maps.normal.row(i) - Eigen::RowVector3f(0, 1, 0)).norm(), 1e-6F);
    EXPECT_LT((maps.tangent.row(i) - Eigen::RowVector3f(1, 0, 0)).norm(), 1e-6F);
  }
}

TEST(GeometryMaps, ViewDirectionsTurnWithTheSurface) {
  Mesh mesh = sheet();
  const Eigen::Vector3d camera(0.3, 2, -1);
  const auto before = view_directions(mapped(mesh, 8).maps, camera);
  EXPECT_NEAR((before.rowwise().norm().array() - 1).abs().maxCoeff(), 0, 1e-5);
  // Straight above a texel: its view is along the normal.
  const GeometryMaps flat = mapped(mesh, 8).maps;
  const Eigen::Vector3d above =
      flat.position.row(20).cast<double>().transpose() + Eigen::Vector3d(0, 3, 0);
  EXPECT_LT((view_directions(flat, above).row(20) - Eigen::RowVector3f(0, 0, 1)).norm(), 1e-5F);
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(-1.1, Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  mesh.vertices = (mesh.vertices * turn.transpose()).eval();
  const auto after = view_directions(mapped(mesh, 8).maps, turn * camera);
  EXPECT_LT((after - before).cwiseAbs().maxCoeff(), 1e-4F);
}

TEST(GeometryMaps, PicturesFillWhatIsBesideACharts) {
  Mesh mesh = sheet();
  mesh.uvs = 0.25 + 0.5 * mesh.uvs.array();
  const auto [texels, maps] = mapped(mesh, 32);
  const Image normal = texture_of(texels, maps.normal);
  EXPECT_EQ(normal.at(16, 16, 1), 1.0F);
  EXPECT_EQ(normal.at(7, 16, 1), 1.0F);  // one texel outside
  EXPECT_EQ(normal.at(1, 16, 1), 0.0F);  // far outside
}

TEST(Occlusion, OfAFloorBesideAHighWallIsOneHalf) {
  // A wall far longer and higher than the floor's texels are away from it hides half of the sky.
  const Mesh floor = sheet();
  const Mesh wall = testing::mesh_of({{-50, 0, 1}, {50, 0, 1}, {50, 80, 1}, {-50, 80, 1}},
                                     {{0, 1, 2}, {0, 2, 3}});
  const auto [texels, maps] = mapped(floor, 8);
  OcclusionOptions options;
  options.reach = 100;
  options.strata = 16;
  const Eigen::VectorXf open =
      ambient_visibility(maps, build_tree(floor.vertices, floor.faces), options);
  EXPECT_GT(open.minCoeff(), 0.999F);  // a plane does not hide itself
  const Eigen::VectorXf half =
      ambient_visibility(maps, build_tree(wall.vertices, wall.faces), options);
  EXPECT_NEAR(half.mean(), 0.5, 0.01);
  EXPECT_NEAR(half.minCoeff(), 0.5, 0.05);
}

TEST(Occlusion, OfAHorizonAtAnAngleFollowsTheCosineLaw) {
  // A wide lid at height 1 with a round hole of radius 1 above one texel lets through sin^2 of 45
  // degrees: one half.
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<int, 3>> faces;
  constexpr int kSides = 256;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    for (const double radius : {1.0, 60.0}) {
      vertices.push_back({radius * std::cos(angle), 1.0, radius * std::sin(angle)});
    }
    const int a = 2 * i;
    const int b = 2 * ((i + 1) % kSides);
    faces.push_back({a, a + 1, b});
    faces.push_back({b, a + 1, b + 1});
  }
  const Mesh lid = testing::mesh_of(vertices, faces);
  GeometryMaps point;
  point.position = Eigen::RowVector3f(0, 0, 0);
  point.normal = Eigen::RowVector3f(0, 1, 0);
  point.tangent = Eigen::RowVector3f(1, 0, 0);
  OcclusionOptions options;
  options.strata = 32;
  options.reach = 100;
  options.offset = 0;
  const TriangleTree tree = build_tree(lid.vertices, lid.faces);
  EXPECT_NEAR(ambient_visibility(point, tree, options)[0], 0.5, 0.01);
  options.reach = 0.9;  // below the lid
  EXPECT_EQ(ambient_visibility(point, tree, options)[0], 1.0F);
}

TEST(Occlusion, IsTheSameOnAnyNumberOfThreads) {
  const Mesh ball = testing::sphere(3);
  const auto [texels, maps] = mapped(sheet(), 16);
  const TriangleTree tree = build_tree(ball.vertices, ball.faces);
  set_thread_count(1);
  const Eigen::VectorXf one = ambient_visibility(maps, tree);
  set_thread_count(3);
  const Eigen::VectorXf three = ambient_visibility(maps, tree);
  set_thread_count(0);
  EXPECT_EQ(one, three);
}

Camera from_above() {
  Camera camera;
  camera.id = "above";
  camera.width = camera.height = 64;
  camera.fx = camera.fy = 64;
  camera.cx = camera.cy = 32;
  camera.camera_from_world_rotation << 1, 0, 0, 0, 0, 1, 0, -1,
      0;  // looks down, z of the world down
  camera.camera_from_world_translation = {-0.5, -0.5, 2};
  return camera;
}

TEST(VisiblePixels, KnowTheirTextureAndWhatHidesThem) {
  const Mesh cloth = sheet();
  Mesh lid = testing::grid(1, 1);
  lid.vertices.col(0) *= 0.5;
  lid.vertices.col(1).array() += 0.5;  // hides a little more than the left half
  const auto pixels = visible_pixels({{&lid.vertices, &lid.faces}, {&cloth.vertices, &cloth.faces}},
                                     1, cloth.uvs, cloth.uv_faces, from_above());
  ASSERT_GT(pixels.pixel.size(), 300U);
  int trusted = 0;
  for (std::size_t i = 0; i < pixels.pixel.size(); ++i) {
    const double x = pixels.pixel[i] % 64 + 0.5;
    const double y = pixels.pixel[i] / 64 + 0.5;
    // The plane is 2 m away: a pixel is 1/32 m.
    EXPECT_NEAR(pixels.u[i], 0.5 + (x - 32) / 32, 1e-3);
    EXPECT_NEAR(pixels.v[i], 1 - (0.5 + (y - 32) / 32), 1e-3);
    EXPECT_NEAR(pixels.depth[i], 2, 1e-5);
    EXPECT_GT(pixels.u[i], 0.5 - 1.0 / 32);
    trusted += pixels.trusted[i];
    if (pixels.trusted[i] != 0) {
      EXPECT_GT(pixels.u[i], 0.5 + 1.0 / 32);
      EXPECT_LT(pixels.u[i], 1 - 2.0 / 32);
    }
  }
  EXPECT_GT(trusted, 200);
}

TEST(GeometryMapsRefused, WhatDoesNotFit) {
  const Mesh mesh = sheet();
  const TexelMap texels = texel_map(mesh.faces, mesh.uvs, mesh.uv_faces, 8);
  const Triangles fewer = mesh.faces.topRows(3);
  ATELIER_EXPECT_REFUSED(geometry_maps(mesh.vertices, fewer, mesh.uvs, mesh.uv_faces, texels),
                         LogicError, "differ");
  ATELIER_EXPECT_REFUSED(geometry_maps(mesh.vertices, fewer, mesh.uvs, fewer, texels), LogicError,
                         "of other faces");
  ATELIER_EXPECT_REFUSED(texture_of(texels, Eigen::MatrixXf::Zero(3, 3)), LogicError,
                         "each covered texel");
  OcclusionOptions options;
  options.strata = 0;
  ATELIER_EXPECT_REFUSED(ambient_visibility({}, {}, options), LogicError, "out of range");
  ATELIER_EXPECT_REFUSED(
      visible_pixels({{&mesh.vertices, &mesh.faces}}, 1, mesh.uvs, mesh.uv_faces, from_above()),
      LogicError, "not there");
}

}  // namespace
}  // namespace atelier
