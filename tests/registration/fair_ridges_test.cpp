#include "registration/fair_ridges.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/register_garment.h"
#include "tests/registration/registered_shapes.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

constexpr double kFin = 0.04;  // m

/// A tube of cloth with even triangles of 18 mm, and the same with a fin: along a line of its
/// vertices it stands out, while those on either side are drawn together below it.
struct FinnedTube {
  Mesh tube = fixtures::cloth_tube(52, 28);
  Mesh finned = tube;
  Topology topology = topology_of(tube.faces, tube.vertices.rows());
};
FinnedTube finned_tube() {
  FinnedTube shape;
  const Points& x = shape.tube.vertices;
  for (Index v = 0; v < x.rows(); ++v) {
    const double angle = std::atan2(x(v, 2), x(v, 0));
    if (std::abs(x(v, 1) - 1.05) > 0.08) {
      continue;
    }
    const Eigen::RowVector3d outwards(std::cos(angle), 0, std::sin(angle));
    const double around = 0.15 * std::abs(angle);
    if (around < 0.005) {
      shape.finned.vertices.row(v) += kFin * outwards;
    } else if (around < 0.02) {
      shape.finned.vertices.row(v) += 0.5 * kFin * outwards;
      shape.finned.vertices(v, 2) = angle > 0 ? 0.002 : -0.002;
    }
  }
  return shape;
}

TEST(FairRidges, AFinOnATubeGoes) {
  const FinnedTube shape = finned_tube();
  ASSERT_LT(cosines_around(shape.topology, shape.finned.vertices).minCoeff(), 0.3);
  const Points fair = faired_ridges(shape.topology, shape.finned.vertices, {.least = 0.7});
  EXPECT_GE(cosines_around(shape.topology, fair).minCoeff(), 0.7);
  double highest = 0;
  for (Index v = 0; v < fair.rows(); ++v) {
    highest = std::max(highest, std::hypot(fair(v, 0), fair(v, 2)) - 0.15);
  }
  EXPECT_LT(highest, 0.5 * kFin);
}

TEST(FairRidges, WhatIsFarFromAFinStays) {
  const FinnedTube shape = finned_tube();
  const Points fair = faired_ridges(shape.topology, shape.finned.vertices);
  for (Index v = 0; v < fair.rows(); ++v) {
    if (fair(v, 0) < 0) {  // the other side
      EXPECT_EQ(fair.row(v), shape.tube.vertices.row(v));
    }
  }
}

// As between two legs: drawn to the middle of its neighbours a saddle becomes a neck, with a
// sharper edge.
TEST(FairRidges, AKeelInASaddleLeavesTheSaddle) {
  Mesh sheet = fixtures::grid(21, 21);
  const double side = sheet.vertices.col(0).maxCoeff() - sheet.vertices.col(0).minCoeff();
  sheet.vertices *= 0.36 / side;
  const Eigen::RowVector3d middle =
      (sheet.vertices.colwise().maxCoeff() + sheet.vertices.colwise().minCoeff()) / 2;
  sheet.vertices.rowwise() -= middle;
  const auto saddle = [](double x, double z) { return (z * z - x * x) / 0.12; };
  Points smooth = sheet.vertices;
  Points keeled = sheet.vertices;
  for (Index v = 0; v < smooth.rows(); ++v) {
    const double x = smooth(v, 0);
    const double z = smooth(v, 2);
    smooth(v, 1) = saddle(x, z);
    keeled(v, 1) = smooth(v, 1);
    if (std::abs(z) < 0.03 && std::abs(x) < 0.06) {
      keeled(v, 1) -= std::abs(z) < 0.009 ? 0.05 : 0.025;
      keeled(v, 2) *= 0.15;
    }
  }
  const Topology topology = topology_of(sheet.faces, sheet.vertices.rows());
  ASSERT_LT(cosines_around(topology, keeled).minCoeff(), 0.3);
  const Points fair = faired_ridges(topology, keeled);
  EXPECT_GE(cosines_around(topology, fair).minCoeff(), 0.5);
  double lowest = 0;
  for (Index v = 0; v < fair.rows(); ++v) {
    lowest = std::min(lowest, fair(v, 1) - saddle(fair(v, 0), fair(v, 2)));
  }
  EXPECT_GT(lowest, -0.025);  // the keel was 5 cm deep
}

TEST(FairRidges, ASmoothSurfaceStays) {
  const FinnedTube shape = finned_tube();
  EXPECT_EQ(faired_ridges(shape.topology, shape.tube.vertices), shape.tube.vertices);
  const Mesh ball = fixtures::sphere(3);
  EXPECT_EQ(faired_ridges(topology_of(ball.faces, ball.vertices.rows()), ball.vertices),
            ball.vertices);
}

TEST(FairRidges, WithoutRoundsNothingMoves) {
  const FinnedTube shape = finned_tube();
  EXPECT_EQ(faired_ridges(shape.topology, shape.finned.vertices, {.rounds = 0}),
            shape.finned.vertices);
}

TEST(FairRidges, ARimStays) {
  const Mesh folded = fixtures::with_fold_at_rim(fixtures::cloth_tube(24, 14));
  const Topology topology = topology_of(folded.faces, folded.vertices.rows());
  const Points fair = faired_ridges(topology, folded.vertices);
  for (const std::vector<int>& loop : boundary_loops(topology)) {
    for (const int v : loop) {
      EXPECT_EQ(fair.row(v), folded.vertices.row(v));
    }
  }
}

TEST(FairRidges, CosinesAreOneInAPlaneAndMinusOneWhereATriangleLiesOverOthers) {
  Mesh sheet = fixtures::grid(6, 6);
  const Topology topology = topology_of(sheet.faces, sheet.vertices.rows());
  EXPECT_NEAR(cosines_around(topology, sheet.vertices).minCoeff(), 1, 1e-12);
  sheet.vertices.row(sheet.faces(30, 0)).swap(sheet.vertices.row(sheet.faces(30, 1)));
  EXPECT_FALSE(inverted_faces(topology, sheet.vertices).empty());
  EXPECT_LT(cosines_around(topology, sheet.vertices).minCoeff(), -0.9);
}

TEST(FairRidgesRefused, OptionsOutOfRangeAndOtherVertices) {
  const FinnedTube shape = finned_tube();
  const Points& x = shape.finned.vertices;
  EXPECT_THROW(faired_ridges(shape.topology, x, {.least = 1.5}), LogicError);
  EXPECT_THROW(faired_ridges(shape.topology, x, {.least = -2}), LogicError);
  EXPECT_THROW(faired_ridges(shape.topology, x, {.rounds = -1}), LogicError);
  EXPECT_THROW(faired_ridges(shape.topology, x.topRows(5)), LogicError);
  Points broken = x;
  broken(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(faired_ridges(shape.topology, broken), LogicError);
}

}  // namespace
}  // namespace atelier
