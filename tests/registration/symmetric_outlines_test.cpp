// Outlines that are nearly their own mirror image, or each other's, become that.

#include "registration/outlines/symmetric_outlines.h"

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/outlines/alike_outlines.h"
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

Points2 mirrored_and_moved(const Points2& outline, double angle, const Eigen::RowVector2d& to) {
  Points2 image = outline.colwise().reverse();
  image.col(0) *= -1;
  return (image * Eigen::Rotation2Dd(angle).toRotationMatrix().transpose()).rowwise() + to;
}

TEST(AlikeOutlines, MirrorImage_ComesFirst_OtherAreasNever) {
  const Points2 sleeve = through(kSleeve, as_it_is);
  const std::vector<Points2> outlines = {sleeve, through(kFront, as_it_is), 1.05 * sleeve,
                                         mirrored_and_moved(sleeve, 2, {3, -1}), 1.2 * sleeve};
  EXPECT_EQ(alike_outlines(outlines),
            (std::vector<std::vector<std::size_t>>{{3, 2}, {}, {0, 3}, {0, 2}, {}}));
  EXPECT_EQ(alike_outlines({10, sleeve}).front().size(), 6U);
  EXPECT_TRUE(alike_outlines({}).empty());
  EXPECT_THROW(alike_outlines({sleeve.topRows(2)}), LogicError);
}

TEST(SymmetricOutlines, HundredsOfPairs_FindEachOther) {
  std::vector<Points2> outlines;
  double scale = 0.2;
  for (int i = 0; i < 100; ++i, scale *= 1.02) {
    const Points2 left = scale * through(kSleeve, as_it_is);
    Points2 right = mirrored_and_moved(left, 0, {5.0 * i, 1});
    for (Index v = 0; v < right.rows(); ++v) {
      right(v, 1) += 0.004 * scale * std::sin(9 * left(v, 1) / scale);
    }
    outlines.push_back(left);
    outlines.push_back(right);
  }
  const std::vector<Points2> result = symmetric_outlines(outlines, 0.01);
  double before = 0;
  double after = 0;
  for (std::size_t i = 0; i < outlines.size(); i += 2) {
    before += mirror_match(outlines[i], outlines[i + 1]).off;
    after += mirror_match(result[i], result[i + 1]).off;
  }
  EXPECT_LT(after, before / 4);
}

TEST(SymmetricOutlines, SmallOutline_IsNoMirrorImageWithinItsOwnSize) {
  // A chart of 1 cm is within 1 cm of anything.
  const Points2 chart = 0.04 * through(kSleeve, as_it_is);
  EXPECT_EQ(symmetric_outlines({chart}, 0.01).front(), chart);
}

TEST(SymmetricOutlines, WhatIsNoMirrorImage_Stays) {
  const Points2 sleeve = through(kSleeve, as_it_is);
  EXPECT_EQ(symmetric_outlines({sleeve}, 0.01).front(), sleeve);
  EXPECT_EQ(symmetric_outlines({sleeve}, 0).front(), sleeve);
  EXPECT_TRUE(symmetric_outlines({}, 0.01).empty());
}

}  // namespace
}  // namespace atelier
