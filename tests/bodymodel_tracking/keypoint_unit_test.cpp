// Keypoints that are no person's in metres.
#include "bodymodel/tracking/keypoint_unit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/bodymodel_tracking/posed_person.h"

namespace atelier::fixtures {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

/// Somebody's keypoints, by that much too large in each frame.
std::vector<FrameTargets> scaled(const std::vector<double>& factors) {
  Random random{6};
  std::vector<FrameTargets> frames;
  for (const double factor : factors) {
    frames.push_back(keypoints_of(fitted_human(), walking(fitted_human(), 0.2), 0.004, random));
    frames.back().keypoints *= factor;
  }
  return frames;
}

TEST(KeypointUnit, TooLargeFrames_AreRemovedAndTheLargestReported) {
  std::vector<FrameTargets> frames = scaled({1, 1000, 1, 100});
  const OtherUnits others = without_other_units(frames);
  EXPECT_THAT(others.frames, ElementsAre(1, 3));
  EXPECT_TRUE(others.is_one(3));
  EXPECT_FALSE(others.is_one(2));
  EXPECT_EQ(frames[1].keypoints.rows(), 0);
  EXPECT_EQ(frames[1].deviations.size(), 0);
  EXPECT_GT(frames[2].keypoints.rows(), 0);
  EXPECT_GT(others.most, 5 * others.least);
  const Finding finding = keypoint_unit(others, {10, 11, 12, 13}, "gone");
  EXPECT_EQ(finding.code, "keypoint-unit");
  EXPECT_EQ(finding.place, "frames 11, 13");
  char most[64];
  std::snprintf(most, sizeof most, "are up to %.3g m from", others.most);
  EXPECT_THAT(finding.what, HasSubstr(most));
  EXPECT_EQ(finding.advice, "left out; gone; look whether they are in millimetres");
}

TEST(KeypointUnit, TooSmallFrames_AreNotCalledMillimetres) {
  std::vector<FrameTargets> frames = scaled({0.005, 0.001, 0.002, 1});
  const OtherUnits others = without_other_units(frames);
  EXPECT_THAT(others.frames, ElementsAre(0, 1, 2));
  const Finding finding = keypoint_unit(others, {0, 1, 2, 3}, "gone");
  char least[64];
  std::snprintf(least, sizeof least, "are as little as %.3g m from", others.least);
  EXPECT_THAT(finding.what, HasSubstr(least));
  EXPECT_LT(others.least, 0.001);
  EXPECT_THAT(finding.advice, HasSubstr("kilometres"));
  EXPECT_THAT(finding.advice, Not(HasSubstr("millimetres")));
}

TEST(KeypointUnit, TooLargeAndTooSmallFrames_GiveOneFinding) {
  std::vector<FrameTargets> frames = scaled({1000, 1, 0.001});
  const OtherUnits others = without_other_units(frames);
  const Finding finding = keypoint_unit(others, {0, 1, 2}, "gone");
  EXPECT_EQ(finding.place, "frames 0, 2");
  EXPECT_THAT(finding.what, HasSubstr(" m to "));
  EXPECT_THAT(finding.advice, HasSubstr("in what unit they are"));
}

TEST(KeypointUnit, PlausibleFrames_AreKept) {
  std::vector<FrameTargets> frames = scaled({1, 0.3, 2});
  frames[0].keypoints.row(3) *= 1000;  // one that is far off says nothing of the others
  frames.push_back({});
  FrameTargets two = frames[1];
  two.keypoints *= 1000;
  two.deviations.tail(two.deviations.size() - 2).setZero();
  frames.push_back(two);
  EXPECT_THAT(without_other_units(frames).frames, ElementsAre());
  EXPECT_THROW(keypoint_unit({}, {0}, ""), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
