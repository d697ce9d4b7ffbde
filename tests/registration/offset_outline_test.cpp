#include "registration/flattening/offset_outline.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/flattening/flat_overlaps.h"

namespace atelier {
namespace {

TEST(OffsetOutline, Offset_KeepsItsDistance) {
  Points2 square(4, 2);
  square << 0, 0, 1, 0, 1, 1, 0, 1;
  const Points2 offset = offset_outline(square, 0.1);
  EXPECT_DOUBLE_EQ(offset.col(0).minCoeff(), -0.1);
  EXPECT_DOUBLE_EQ(offset.col(1).maxCoeff(), 1.1);
  EXPECT_FALSE(crosses_itself(offset));
  Points2 star(40, 2);
  for (int i = 0; i < 40; ++i) {
    const double angle = 2 * std::numbers::pi * i / 40;
    const double r = i % 2 == 0 ? 1 : 0.6;
    star.row(i) << r * std::cos(angle), r * std::sin(angle);
  }
  const Points2 round = offset_outline(star, 0.08);
  EXPECT_FALSE(crosses_itself(round));
  for (Index i = 0; i < round.rows(); ++i) {
    double nearest = 10;
    for (Index j = 0; j < 40; ++j) {
      const Eigen::Vector2d a = star.row(j);
      const Eigen::Vector2d b = star.row((j + 1) % 40);
      const Eigen::Vector2d p = round.row(i);
      const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
      nearest = std::min(nearest, (a + t * (b - a) - p).norm());
    }
    EXPECT_GT(nearest, 0.08 - 1e-9);
    EXPECT_LT(nearest, 0.17);
  }
}

TEST(OffsetOutline, BadOutlineOrDistance_IsRefused) {
  Points2 two(2, 2);
  two << 0, 0, 1, 0;
  EXPECT_THROW(offset_outline(two, 0.1), LogicError);
  Points2 square(4, 2);
  square << 0, 0, 1, 0, 1, 1, 0, 1;
  EXPECT_THROW(offset_outline(square, -1), LogicError);
  EXPECT_THROW(offset_outline(square, std::nan("")), LogicError);
}

}  // namespace
}  // namespace atelier
