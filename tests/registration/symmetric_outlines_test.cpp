// Outlines that are nearly their own mirror image, or each other's, become that.

#include "registration/outlines/symmetric_outlines.h"

#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "registration/outlines/outline_measures.h"

namespace atelier {
namespace {

/// A closed line through corners, in points every centimetre, moved by `moved` at each.
Points2 through(const std::vector<Eigen::Vector2d>& corners,
                const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& moved) {
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d a = corners[i];
    const Eigen::Vector2d b = corners[(i + 1) % corners.size()];
    const auto steps = static_cast<int>(std::ceil((b - a).norm() / 0.01));
    for (int k = 0; k < steps; ++k) {
      points.push_back(a + (b - a) * k / steps);
    }
  }
  Points2 line(static_cast<Index>(points.size()), 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    line.row(static_cast<Index>(i)) = moved(points[i]).transpose();
  }
  return line;
}

const std::vector<Eigen::Vector2d> kFront = {{-0.2, 0},  {0.2, 0},    {0.25, 0.4},
                                             {0.1, 0.6}, {-0.1, 0.6}, {-0.25, 0.4}};
const std::vector<Eigen::Vector2d> kSleeve = {{0, 0}, {0.3, 0}, {0.34, 0.25}, {0.1, 0.4}};

Eigen::Vector2d as_it_is(const Eigen::Vector2d& point) {
  return point;
}

TEST(SymmetricOutlines, FrontWithALowerShoulder_BecomesItsOwnMirrorImage) {
  // The left side hangs 8 mm lower at the top.
  const Points2 front = through(kFront, [](const Eigen::Vector2d& p) -> Eigen::Vector2d {
    return {p.x(), p.y() - 0.008 * std::max(0.0, p.x() / 0.25) * p.y() / 0.6};
  });
  const double before = measure_outlines({front}).asymmetry;
  const double least = measure_outlines({through(kFront, as_it_is)}).asymmetry;  // of its points
  const std::vector<Points2> result = symmetric_outlines({front}, 0.01);
  ASSERT_EQ(result.front().rows(), front.rows());
  EXPECT_GT(before, 1e-3);
  EXPECT_LT(measure_outlines(result).asymmetry, least + (before - least) / 4);
  EXPECT_LT((result.front() - front).rowwise().norm().maxCoeff(), 0.01);
  EXPECT_LT(mirror_line(result.front()).off, 1e-3);
}

TEST(SymmetricOutlines, TwoSleeves_BecomeEachOthers) {
  const Points2 left = through(kSleeve, as_it_is);
  std::vector<Eigen::Vector2d> mirrored;
  for (auto corner = kSleeve.rbegin(); corner != kSleeve.rend(); ++corner) {
    mirrored.emplace_back(1 - corner->x(), corner->y());
  }
  const Points2 right = through(mirrored, [](const Eigen::Vector2d& p) -> Eigen::Vector2d {
    return p + Eigen::Vector2d(0.006 * std::sin(9 * p.y()), 0);
  });
  const double before = measure_outlines({left, right}).asymmetry;
  const std::vector<Points2> result = symmetric_outlines({left, right}, 0.01);
  EXPECT_LT(measure_outlines(result).asymmetry, before / 2);
}

TEST(SymmetricOutlines, WhatIsNoMirrorImage_Stays) {
  const Points2 sleeve = through(kSleeve, as_it_is);
  EXPECT_EQ(symmetric_outlines({sleeve}, 0.01).front(), sleeve);
  EXPECT_EQ(symmetric_outlines({sleeve}, 0).front(), sleeve);
  EXPECT_TRUE(symmetric_outlines({}, 0.01).empty());
}

}  // namespace
}  // namespace atelier
