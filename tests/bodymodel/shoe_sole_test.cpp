#include "bodymodel/underlying/shoe_sole.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/normals.h"

namespace atelier {
namespace {

constexpr double kLength = 0.28;
constexpr double kWidth = 0.1;
constexpr double kHeight = 0.07;

/// How far the sole lies above the lowest of the shoe: its arch.
double arch_of(double along) {
  return 0.015 * std::exp(-std::pow((along - 0.1) / 0.03, 2));
}

/// Points of the two sides of a shoe, and no others.
Points sides(const ShoeAxes& axes, double scale = 1) {
  constexpr int kAlong = 141;
  constexpr int kDown = 15;
  const Eigen::Vector3d across = axes.down.cross(axes.along);
  Points points(2 * kAlong * kDown, 3);
  Index row = 0;
  for (int side = -1; side <= 1; side += 2) {
    for (int i = 0; i < kAlong; ++i) {
      const double along = kLength * i / (kAlong - 1);
      for (int k = 0; k < kDown; ++k) {
        const double down = (kHeight - arch_of(along)) * k / (kDown - 1);
        points.row(row++) =
            (scale * (along * axes.along + side * kWidth / 2 * across + down * axes.down))
                .transpose();
      }
    }
  }
  return points;
}

ShoeAxes turned_axes() {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  return {-turn.col(1), turn.col(2)};
}

TEST(ShoeSole, ShoeOfWhichTheSidesAreSeen_IsClosedWhereTheyEnd) {
  const ShoeAxes axes = turned_axes();
  const Mesh sole = shoe_sole(sides(axes), axes);
  ASSERT_GT(sole.faces.rows(), 100);
  const Eigen::Vector3d across = axes.down.cross(axes.along);
  for (Index v = 0; v < sole.vertices.rows(); ++v) {
    const Eigen::Vector3d at = sole.vertices.row(v).transpose();
    EXPECT_NEAR(at.dot(axes.down), kHeight - arch_of(at.dot(axes.along)), 0.003);
    EXPECT_LE(std::abs(at.dot(across)), kWidth / 2 + 1e-9);
  }
  const Eigen::VectorXd along = sole.vertices * axes.along;
  EXPECT_LT(along.minCoeff(), 0.01);
  EXPECT_GT(along.maxCoeff(), kLength - 0.01);
  const Points normals = face_normals(sole.vertices, sole.faces);
  EXPECT_GT((normals * axes.down).minCoeff(), 0.5) << "it looks down";
}

TEST(ShoeSole, WhatIsNoShoe_HasNone) {
  const ShoeAxes axes = turned_axes();
  EXPECT_EQ(shoe_sole(sides(axes).topRows(99), axes).faces.rows(), 0);
  EXPECT_EQ(shoe_sole(sides(axes, 3), axes).faces.rows(), 0) << "as large as a chair";
  EXPECT_EQ(shoe_sole(sides(axes, 0.2), axes).faces.rows(), 0);
  EXPECT_EQ(shoe_sole(Points(0, 3), axes).faces.rows(), 0);
}

}  // namespace
}  // namespace atelier
