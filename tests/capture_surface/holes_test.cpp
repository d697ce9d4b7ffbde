#include "capture/surface/holes.h"

#include <cmath>

#include <gtest/gtest.h>

#include "capture/surface/hull_support.h"
#include "core/error.h"
#include "tests/capture_stereo/textured_ball.h"
#include "tests/support/shapes.h"

namespace atelier::fixtures {
namespace {

TEST(Holes, ClosedSurface_HasNone) {
  EXPECT_TRUE(find_holes(tetrahedron()).empty());
}

TEST(Holes, TetrahedronWithoutAFace_HasOneHole) {
  Mesh open = tetrahedron();
  const Eigen::RowVector3i face = open.faces.row(3);
  open.faces.conservativeResize(3, 3);
  const std::vector<Hole> holes = find_holes(open);
  ASSERT_EQ(holes.size(), 1u);
  EXPECT_EQ(holes[0].loop.size(), 3u);
  const double side = 2 * std::sqrt(2.0);
  EXPECT_NEAR(holes[0].length, 3 * side, 1e-12);
  EXPECT_NEAR(holes[0].area, std::sqrt(3.0) / 4 * side * side, 1e-12);
  const Eigen::RowVector3d middle =
      (open.vertices.row(face(0)) + open.vertices.row(face(1)) + open.vertices.row(face(2))) / 3;
  EXPECT_LT((holes[0].centre.transpose() - middle).norm(), 1e-12);
}

/// The hull of a ball, and points over its upper half only.
struct HalfSeenBall {
  double radius = 0.3;
  VisualHull hull;
  Mesh points;

  HalfSeenBall() {
    constexpr int kSide = 40;
    hull.origin = Eigen::Vector3d::Constant(-0.4);
    hull.voxel_size = 0.02;
    hull.nx = hull.ny = hull.nz = kSide;
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          const Eigen::Vector3d centre =
              hull.origin + hull.voxel_size * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
          hull.occupied.push_back(centre.norm() < radius ? 1 : 0);
        }
      }
    }
    constexpr int kRound = 60;
    constexpr int kUp = 15;
    points.vertices.resize(static_cast<Index>(kRound) * kUp, 3);
    for (int i = 0; i < kUp; ++i) {
      for (int j = 0; j < kRound; ++j) {
        const double up = 1.57 * i / kUp;
        const double round = 2 * 3.14159265 * j / kRound;
        points.vertices.row(static_cast<Index>(i) * kRound + j)
            << radius * std::cos(up) * std::cos(round),
            radius * std::sin(up), radius * std::cos(up) * std::sin(round);
      }
    }
    points.colors = Colors::Constant(points.vertices.rows(), 3, 0.5F);
  }
};

TEST(HullSupport, UnseenSide_IsSupportedByTheHull) {
  const HalfSeenBall seen;
  const Mesh support = hull_support(seen.hull, {}, seen.points, 0.05, 0.1);
  ASSERT_GT(support.vertices.rows(), 100);
  EXPECT_LT(support.vertices.col(1).maxCoeff(), 0);
  EXPECT_EQ(support.confidence.maxCoeff(), 0);
  EXPECT_EQ(support.colors.rows(), support.vertices.rows());
  for (Index i = 0; i < support.vertices.rows(); ++i) {
    const Eigen::RowVector3d place = support.vertices.row(i);
    ASSERT_NEAR(place.norm(), seen.radius, 2 * seen.hull.voxel_size) << place;
    ASSERT_GT(support.normals.row(i).dot(place), 0.7 * place.norm()) << place;
  }
}

TEST(HullSupport, DepthMapSeeingThrough_RemovesSupport) {
  const HalfSeenBall seen;
  // From below, a surface well inside the hull.
  DepthMap map;
  map.camera = TexturedBall().views(1, 0, 100, 100)[0].camera;
  map.camera.camera_from_world_rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  map.camera.camera_from_world_translation << 0, 0, 2;
  map.depth = Image(100, 100, 1);
  map.confidence = Image(100, 100, 1);
  std::fill(map.depth.data.begin(), map.depth.data.end(), 1.9F);
  std::fill(map.confidence.data.begin(), map.confidence.data.end(), 1.0F);
  const Mesh all = hull_support(seen.hull, {}, seen.points, 0.05, 0.1);
  const Mesh rest = hull_support(seen.hull, {map}, seen.points, 0.05, 0.1);
  EXPECT_LT(all.vertices.col(1).minCoeff(), -0.28);
  EXPECT_GT(rest.vertices.col(1).minCoeff(), -0.15);
}

TEST(HullSupport, SupportWithoutPoints_IsRefused) {
  const HalfSeenBall seen;
  EXPECT_THROW(hull_support(seen.hull, {}, Mesh{}, 0.05, 0.1), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
