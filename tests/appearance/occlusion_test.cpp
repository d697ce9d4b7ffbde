#include "appearance/occlusion.h"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "appearance/joined_surfaces.h"
#include "appearance/occlusion_math.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/tree.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// The plane y = 0 over [0,1]^2.
Mesh floor_mesh() {
  return fixtures::grid(4, 4);
}

SurfaceFrame floor_frame(const Mesh& mesh) {
  return surface_frame(mesh.vertices, mesh.faces, mesh.vertices.leftCols<2>(), mesh.faces);
}

using Visibility = Eigen::Matrix<float, Eigen::Dynamic, 2>;

/// Degree 0 of both sides.
Visibility visibility_of(const SurfaceFrame& frame, const TriangleTree& tree,
                         const OcclusionOptions& options) {
  const TransferRows transfer = light_transfer(frame, tree, options);
  Visibility both(transfer.rows(), 2);
  both << transfer.col(0), transfer.col(kTransferTerms);
  return both;
}

/// Points at the origin with random normals.
SurfaceFrame random_points(Index count) {
  Random random{7};
  SurfaceFrame points;
  points.position = FloatRows::Zero(count, 3);
  points.normal.resize(count, 3);
  for (Index v = 0; v < count; ++v) {
    for (Index k = 0; k < 3; ++k) {
      points.normal(v, k) = static_cast<float>(normal(random));
    }
    points.normal.row(v).normalize();
  }
  return points;
}

/// So many at the origin, each with rays of its own.
SurfaceFrame upward_points(Index count) {
  SurfaceFrame points;
  points.position = FloatRows::Zero(count, 3);
  points.normal = Eigen::RowVector3f(0, 1, 0).replicate(count, 1);
  return points;
}

OcclusionOptions finest() {
  OcclusionOptions options;
  options.strata = 32;
  options.reach = 100;
  options.offset = 0;
  return options;
}

using Harmonics = Eigen::Matrix<double, 1, kTransferTerms>;

Harmonics harmonics_of(Vec3d direction) {
  Harmonics terms;
  spherical_harmonics(direction, terms.data());
  return terms;
}

/// A triangle too far away to hide anything.
TriangleTree nothing() {
  const Mesh far = fixtures::mesh_of({{500, 0, 0}, {501, 0, 0}, {500, 1, 0}}, {{0, 1, 2}});
  return build_tree(far.vertices, far.faces);
}

TEST(Occlusion, OpenSky_GivesTheCosineLobe) {
  const SurfaceFrame points = random_points(12);
  const TransferRows transfer = light_transfer(points, nothing(), finest());
  for (Index v = 0; v < points.position.rows(); ++v) {
    for (const Index side : {0, 1}) {
      const float sign = side == 0 ? 1 : -1;
      const Eigen::RowVector3d along = sign * points.normal.row(v).cast<double>();
      // Ramamoorthi and Hanrahan: A_0, A_1, A_2 over pi.
      Harmonics lobe = harmonics_of({along.x(), along.y(), along.z()});
      lobe.segment<3>(1) *= 2.0 / 3;
      lobe.tail<5>() /= 4;
      const Harmonics found =
          transfer.row(v).segment<kTransferTerms>(kTransferTerms * side).cast<double>();
      EXPECT_EQ(found[0], 1);
      EXPECT_LT((found - lobe).cwiseAbs().maxCoeff(), 0.01) << v << " " << side;
    }
  }
}

TEST(Occlusion, HalfASky_GivesHalfTheCosineLobe) {
  const Mesh wall = fixtures::mesh_of({{-90, 0, 0.1}, {90, 0, 0.1}, {90, 90, 0.1}, {-90, 90, 0.1}},
                                      {{0, 1, 2}, {0, 2, 3}});
  const SurfaceFrame point = upward_points(1);
  const TransferRows transfer =
      light_transfer(point, build_tree(wall.vertices, wall.faces), finest());
  // Integrals over the half of the unit disk where z < 0, over pi: directions are (x, y, z) with
  // y^2 = 1 - x^2 - z^2.
  constexpr double kY = 1.0 / 3;
  constexpr double kZ = -2 / (3 * std::numbers::pi);
  constexpr double kYZ = -1.0 / 8;
  constexpr double kXX = 1.0 / 8;
  constexpr double kYY = 1.0 / 4;
  constexpr double kZZ = 1.0 / 8;
  Harmonics half;
  half << 0.5, std::sqrt(3) * kY, std::sqrt(3) * kZ, 0, 0, std::sqrt(15) * kYZ,
      std::sqrt(5) / 2 * (3 * kZZ - 0.5), 0, std::sqrt(15) / 2 * (kXX - kYY);
  EXPECT_LT((transfer.leftCols<kTransferTerms>().cast<double>() - half).cwiseAbs().maxCoeff(),
            0.02);
}

TEST(Occlusion, SmoothSkyLight_IsADotProduct) {
  // A ball hides a part of the sky, whose light is any sum of harmonics.
  Mesh ball = fixtures::sphere(4);
  ball.vertices *= 0.5;
  ball.vertices.rowwise() += Eigen::RowVector3d(0.4, 0.9, -0.3);
  const TriangleTree tree = build_tree(ball.vertices, ball.faces);
  // 1024 rays are off by 0.004 (about 60 cells have the ball's edge in them), 16 times as many by
  // a quarter of that.
  const TransferRows transfer = light_transfer(upward_points(16), tree, finest());
  Harmonics sky;
  sky << 1, 0.3, -0.2, 0.4, 0.1, -0.3, 0.2, 0.25, -0.1;
  constexpr int kRings = 200;
  const double step = std::numbers::pi / 2 / kRings;
  double light = 0;
  double open = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double polar = (ring + 0.5) * step;
    for (int i = 0; i < 4 * kRings; ++i) {
      const double azimuth = (i + 0.5) * step;
      const Vec3d towards = {std::sin(polar) * std::cos(azimuth), std::cos(polar),
                             std::sin(polar) * std::sin(azimuth)};
      if (hit_in_tree(view_of(tree), Vec3d{0, 0, 0}, towards, 0.0, 100.0, true).face < 0) {
        const double weight =
            towards.y * std::sin(polar) * step * step / std::numbers::pi;  // cosine, solid angle
        light += weight * sky.dot(harmonics_of(towards));
        open += weight;
      }
    }
  }
  EXPECT_LT(open, 0.9);
  const Harmonics outside = transfer.leftCols<kTransferTerms>().cast<double>().colwise().mean();
  EXPECT_NEAR(outside[0], open, 0.005);
  EXPECT_NEAR(outside.dot(sky), light, 0.005);
}

TEST(Occlusion, DegreeZero_IsTheFractionOfOpenRays) {
  const Mesh ball = fixtures::sphere(3);
  const TransferRows transfer =
      light_transfer(floor_frame(floor_mesh()), build_tree(ball.vertices, ball.faces));
  EXPECT_LT(transfer.minCoeff(), 1);
  for (const Index column : {0, kTransferTerms}) {
    for (const float share : transfer.col(column)) {
      const float rays = std::round(64 * share);
      EXPECT_EQ(share, rays / 64);
    }
  }
}

TEST(Occlusion, FloorBesideHighWall_SeesHalfTheSky) {
  // A wall far longer and higher than the floor's texels are away from it hides half of the sky.
  const Mesh floor = floor_mesh();
  const Mesh wall = fixtures::mesh_of({{-50, 0, 1}, {50, 0, 1}, {50, 80, 1}, {-50, 80, 1}},
                                      {{0, 1, 2}, {0, 2, 3}});
  SurfaceFrame frame = floor_frame(floor);
  OcclusionOptions options;
  options.reach = 100;
  options.strata = 16;
  const Visibility open = visibility_of(frame, build_tree(floor.vertices, floor.faces), options);
  EXPECT_GT(open.minCoeff(), 0.999F);  // a plane does not hide itself, from either side
  frame.position.col(2) *= 0.9F;       // none within the wall
  const Visibility half = visibility_of(frame, build_tree(wall.vertices, wall.faces), options);
  EXPECT_NEAR(half.col(0).mean(), 0.5, 0.01);
  EXPECT_NEAR(half.col(0).minCoeff(), 0.5, 0.05);
  EXPECT_GT(half.col(1).minCoeff(), 0.98F);  // which stands on the floor
}

TEST(Occlusion, HorizonAtAnAngle_FollowsTheCosineLaw) {
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
  const Mesh lid = fixtures::mesh_of(vertices, faces);
  SurfaceFrame point;
  point.position = Eigen::RowVector3f(0, 0, 0);
  point.normal = Eigen::RowVector3f(0, 1, 0);
  OcclusionOptions options;
  options.strata = 32;
  options.reach = 100;
  options.offset = 0;
  const TriangleTree tree = build_tree(lid.vertices, lid.faces);
  EXPECT_NEAR(visibility_of(point, tree, options)(0, 0), 0.5, 0.01);
  EXPECT_EQ(visibility_of(point, tree, options)(0, 1), 1.0F);
  options.reach = 0.9;  // below the lid
  EXPECT_EQ(visibility_of(point, tree, options)(0, 0), 1.0F);
}

TEST(Occlusion, AnyThreadCount_GivesTheSameTransfer) {
  const Mesh ball = fixtures::sphere(3);
  const SurfaceFrame frame = floor_frame(floor_mesh());
  const TriangleTree tree = build_tree(ball.vertices, ball.faces);
  set_thread_count(1);
  const TransferRows one = light_transfer(frame, tree);
  set_thread_count(3);
  const TransferRows three = light_transfer(frame, tree);
  set_thread_count(0);
  EXPECT_EQ(one, three);
}

TEST(Occlusion, CudaAndCpu_Agree) {
  Mesh cloth = floor_mesh();
  cloth.vertices.col(1) = 0.2 * (9 * cloth.vertices.col(0).array()).sin();
  const Mesh ball = fixtures::sphere(3);
  const JoinedSurfaces all =
      joined_surfaces({{&ball.vertices, &ball.faces}, {&cloth.vertices, &cloth.faces}});
  const TriangleTree tree = build_tree(all.vertices, all.faces);
  const SurfaceFrame frame = floor_frame(cloth);
  try {
    const TransferRows cuda = light_transfer(frame, tree, {}, Device::Cuda);
    // A ray that grazes a face may go either way: of 64, none further from 0 than the root of 5.
    EXPECT_LE((cuda - light_transfer(frame, tree)).cwiseAbs().maxCoeff(), 2.25F / 64);
  } catch (const EnvironmentError& error) {
    GTEST_SKIP() << error.what();
  }
}

TEST(OcclusionRefused, OptionsOutOfRange_Throw) {
  OcclusionOptions options;
  options.strata = 0;
  ATELIER_EXPECT_REFUSED(light_transfer({}, {}, options), LogicError, "out of range");
}

}  // namespace
}  // namespace atelier
