#include "registration/outlines/fit_runs.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"

namespace atelier {
namespace {

template <typename Curve>
Points2 sampled(int count, const Curve& curve) {
  Points2 run(count + 1, 2);
  for (int i = 0; i <= count; ++i) {
    run.row(i) = curve(static_cast<double>(i) / count).transpose();
  }
  return run;
}

/// The fitted edges as a panel that closes along straight lines far below.
Panel panel_of(const FittedRuns& fitted) {
  Panel panel;
  panel.corners = fitted.corners[0];
  panel.edges = fitted.edges[0];
  for (std::size_t i = 0; i < panel.edges.size(); ++i) {
    panel.edges[i].start = static_cast<int>(i);
    panel.edges[i].end = static_cast<int>(i) + 1;
  }
  return panel;
}

TEST(FitRuns, NoisyLine_BecomesOneLine) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> noise(-0.002, 0.002);
  const Points2 run =
      sampled(40, [&](double t) { return Eigen::Vector2d(0.8 * t, noise(random)); });
  const FittedRuns fitted = fit_runs({run});
  ASSERT_EQ(fitted.edges[0].size(), 1U);
  EXPECT_TRUE(is_straight(fitted.edges[0][0]));
  EXPECT_EQ(fitted.corners[0].row(0), run.row(0)) << "ends stay";
  EXPECT_EQ(fitted.corners[0].row(1), run.row(40));
}

TEST(FitRuns, Arc_HasItsBulge) {
  constexpr double kAngle = 1.2;
  const FittedRuns fitted = fit_runs({sampled(60, [](double t) {
    return Eigen::Vector2d(0.3 * std::cos(kAngle * t), 0.3 * std::sin(kAngle * t));
  })});
  ASSERT_EQ(fitted.edges[0].size(), 1U);
  EXPECT_TRUE(fitted.edges[0][0].controls.empty());
  EXPECT_NEAR(fitted.edges[0][0].bulge, std::tan(kAngle / 4), 0.005)
      << "counter-clockwise: positive";
}

TEST(FitRuns, CurveAndCorner_ArePartedThereAndKeepToThePoints) {
  // An armhole of sorts, then a straight side.
  const auto curve = [](double t) {
    return t < 0.5 ? Eigen::Vector2d(0.2 * t, 0.1 * std::pow(2 * t, 3))
                   : Eigen::Vector2d(0.1 + 0.4 * (t - 0.5), 0.1 - 0.2 * (t - 0.5));
  };
  const Points2 run = sampled(80, curve);
  const FittedRuns fitted = fit_runs({run});
  EXPECT_LE(fitted.edges[0].size(), 3U);
  const Panel panel = panel_of(fitted);
  double farthest = 0;
  for (int e = 0; e < static_cast<int>(panel.edges.size()); ++e) {
    const Points2 drawn = sample_edge(panel, e, 50);
    for (Index i = 0; i < drawn.rows(); ++i) {
      farthest = std::max(farthest, (run.rowwise() - drawn.row(i)).rowwise().norm().minCoeff());
    }
  }
  EXPECT_LT(farthest, 0.006);
  bool at_corner = false;
  for (Index i = 0; i < fitted.corners[0].rows(); ++i) {
    at_corner = at_corner || (fitted.corners[0].row(i) - run.row(40)).norm() < 0.005;
  }
  EXPECT_TRUE(at_corner);
}

TEST(FitRuns, TwoSides_ArePartedAtTheSamePoints) {
  const Points2 flat = sampled(50, [](double t) { return Eigen::Vector2d(t, 0); });
  const Points2 bent = sampled(
      50, [](double t) { return t < 0.4 ? Eigen::Vector2d(t, 0) : Eigen::Vector2d(0.4, t - 0.4); });
  const FittedRuns fitted = fit_runs({flat, bent});
  EXPECT_EQ(fitted.joints.size(), 3U);
  EXPECT_EQ(fitted.joints[1], 20U);
  EXPECT_EQ(fitted.edges[0].size(), fitted.edges[1].size());
}

TEST(FitRuns, ToleranceZero_IsALineForEachSegment) {
  const Points2 run = sampled(7, [](double t) { return Eigen::Vector2d(t, t * t); });
  const FittedRuns fitted = fit_runs({run}, {.reach = 0, .tolerance = 0});
  EXPECT_EQ(fitted.edges[0].size(), 7U);
  EXPECT_EQ(fitted.corners[0], run);
}

TEST(FitRuns, RunsThatDiffer_AreRefused) {
  const Points2 two = Points2::Random(2, 2);
  EXPECT_THROW(fit_runs({}), LogicError);
  EXPECT_THROW(fit_runs({two, Points2::Random(3, 2)}), LogicError);
  EXPECT_THROW(fit_runs({Points2::Random(1, 2)}), LogicError);
}

}  // namespace
}  // namespace atelier
