#include "registration/outlines/outline_measures.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace atelier {
namespace {

Points2 loop_of(const std::vector<Eigen::Vector2d>& points) {
  Points2 loop(static_cast<Index>(points.size()), 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    loop.row(static_cast<Index>(i)) = points[i].transpose();
  }
  return loop;
}

Points2 rectangle(double width, double height) {
  return loop_of({{0, 0}, {width, 0}, {width, height}, {0, height}});
}

TEST(MeasureOutlines, Rectangle_HasFourCornersAndIsSmoothAndSymmetric) {
  const OutlineMeasures measures = measure_outlines({rectangle(0.3, 0.6)});
  EXPECT_EQ(measures.panels, 1);
  EXPECT_EQ(measures.corners_max, 4);
  EXPECT_LT(measures.jaggedness, 1e-3);
  EXPECT_EQ(measures.turns_per_metre, 0);
  EXPECT_LT(measures.asymmetry, 5e-4) << "of corners that are cut between points";
  EXPECT_NEAR(measures.narrowest_neck, 0.3, 0.01);
}

TEST(MeasureOutlines, Zigzag_IsJaggedAndTurnsAtEachTooth) {
  std::vector<Eigen::Vector2d> points{{0, 0.6}, {0, 0}};
  for (int i = 1; i < 20; ++i) {
    points.emplace_back(0.02 * i, i % 2 == 0 ? 0 : -0.01);
  }
  points.emplace_back(0.4, 0);
  points.emplace_back(0.4, 0.6);
  const OutlineMeasures measures = measure_outlines({loop_of(points)});
  EXPECT_GT(measures.jaggedness, 0.001);
  EXPECT_GT(measures.turns_per_metre * 2.1, 15) << "about a turn for each of twenty edges";
}

TEST(MeasureOutlines, LeftAndRight_AreEachOthersMirrorImages) {
  const Points2 left = loop_of({{0, 0}, {0.3, 0}, {0.2, 0.5}, {0, 0.6}});
  const Points2 right = loop_of({{0, 0}, {0, 0.6}, {-0.2, 0.5}, {-0.3, 0}});
  EXPECT_LT(measure_outlines({left, right}).asymmetry, 0.001);
  EXPECT_GT(measure_outlines({left}).asymmetry, 0.01);
}

TEST(MeasureOutlines, Neck_IsFoundBetweenTwoParts) {
  const Points2 dumbbell = loop_of({{0, 0},
                                    {0.3, 0},
                                    {0.3, 0.13},
                                    {0.5, 0.13},
                                    {0.5, 0},
                                    {0.8, 0},
                                    {0.8, 0.3},
                                    {0.5, 0.3},
                                    {0.5, 0.17},
                                    {0.3, 0.17},
                                    {0.3, 0.3},
                                    {0, 0.3}});
  EXPECT_NEAR(measure_outlines({dumbbell}).narrowest_neck, 0.04, 0.002);
}

TEST(MirrorLine, OfASymmetricPiece_IsItsAxis) {
  const MirrorLine line =
      mirror_line(loop_of({{0.1, 0}, {0.5, 0}, {0.45, 0.5}, {0.3, 0.45}, {0.15, 0.5}}));
  EXPECT_LT(line.off, 0.002);
  EXPECT_NEAR(line.point.x(), 0.3, 0.003);
  EXPECT_GT(line.along.y(), 0.999);
}

}  // namespace
}  // namespace atelier
