// How deep points lie inside a body, and where that counts for nothing.
#include "core/depths_inside.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"

namespace atelier {
namespace {

/// Two unit spheres that overlap in a lens of 0.1 m, their centres on a slanting line.
struct Pair {
  Points vertices;
  Triangles faces;
  Eigen::Vector3d axis;  ///< unit, from the one centre (the origin) to the other

  explicit Pair(const Eigen::Vector3d& along) : axis(along.normalized()) {
    constexpr int kRows = 80;
    constexpr int kColumns = 160;
    constexpr int kOne = (kRows + 1) * kColumns;
    vertices.resize(2 * kOne, 3);
    faces.resize(4 * kRows * kColumns, 3);
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitY(), axis);
    Index f = 0;
    for (int s = 0; s < 2; ++s) {
      for (int r = 0; r <= kRows; ++r) {
        for (int c = 0; c < kColumns; ++c) {
          const double polar = std::numbers::pi * r / kRows;
          const double around = 2 * std::numbers::pi * c / kColumns;
          const Eigen::Vector3d p(std::sin(polar) * std::sin(around), std::cos(polar),
                                  std::sin(polar) * std::cos(around));
          vertices.row(s * kOne + r * kColumns + c) = (turn * p + 1.9 * s * axis).transpose();
          if (r < kRows) {
            const int a = s * kOne + r * kColumns + c;
            const int b = s * kOne + r * kColumns + (c + 1) % kColumns;
            faces.row(f++) << a, a + kColumns, b + kColumns;
            faces.row(f++) << a, b + kColumns, b;
          }
        }
      }
    }
  }

  double depth(double along, double room) const {
    return depths_inside((along * axis).transpose(), vertices, faces, room)[0];
  }
};

TEST(DepthsInside, PointInside_GetsDistanceToSurface) {
  const Pair pair({0, 1, 0});
  EXPECT_EQ(pair.depth(-1.2, 0), 0) << "outside";
  EXPECT_NEAR(pair.depth(-0.7, 0), 0.3, 0.002);
  EXPECT_NEAR(pair.depth(0.8, 0), 0.1, 0.002) << "to the other sphere's surface";
  EXPECT_EQ(pair.depth(0.95, 0), 0) << "where the spheres overlap";
  EXPECT_EQ(depths_inside(Points(0, 3), pair.vertices, pair.faces, 0.1).size(), 0);
}

TEST(DepthsInside, PointNearOverlapOfTwoSpheres_GetsZero) {
  for (const Eigen::Vector3d& along :
       {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(1, 0.4, 0.2), Eigen::Vector3d(-0.3, 1, 0.55),
        Eigen::Vector3d(0.39, -1, -0.41)}) {
    const Pair pair(along);
    EXPECT_EQ(pair.depth(0.801, 0.1), 0) << along.transpose();
    EXPECT_GT(pair.depth(0.795, 0.1), 0.09) << along.transpose();
    EXPECT_EQ(pair.depth(0.88, 0.022), 0) << along.transpose();
    EXPECT_GT(pair.depth(0.876, 0.022), 0.02) << along.transpose();
  }
}

TEST(DepthsInside, OutOfRangeFaceIndex_IsRefused) {
  const Pair pair({0, 1, 0});
  Triangles wrong = pair.faces;
  wrong(3, 1) = 1'000'000;
  EXPECT_THROW(depths_inside(Points::Zero(1, 3), pair.vertices, wrong, 0.01), LogicError);
}

}  // namespace
}  // namespace atelier
