#include "registration/tracking/tracking_failure.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

using ::testing::HasSubstr;

TEST(TrackingFailure, TrackedGarment_HasNoFinding) {
  // A dress, and a tee in whose own frame nothing is compared.
  const std::vector<TrackedFrameFigures> frames = {{0, 0.88, 0.83}, {1, 0.96, 0}, {2, 0.85, 0.72}};
  EXPECT_FALSE(tracking_failure("dress", frames));
  EXPECT_FALSE(tracking_failure("dress", {}));
}

TEST(TrackingFailure, FramesWithTrackingFailure_GiveOneFinding) {
  std::vector<TrackedFrameFigures> frames;
  for (int i = 0; i < 12; ++i) {
    frames.push_back({10 + i, 0.5, 0.15});
  }
  frames[3] = {13, 0.96, 0};     // the template's
  frames[5] = {15, 0.9, 0.8};    // followed
  frames[7] = {17, 0.74, 0};     // without images
  frames[11] = {21, 0.9, 0.39};  // slid
  const auto finding = tracking_failure("dress", frames);
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->severity, Severity::Warning);
  EXPECT_EQ(finding->code, "tracking-failure");
  EXPECT_EQ(finding->place, "dress");
  EXPECT_THAT(finding->what, HasSubstr("not to be relied on in 10 of 12 frames (10 to 12, 14, "
                                       "16 to 21)"));
  EXPECT_THAT(finding->what, HasSubstr("only 50% of its surface has a scan near it"));
  EXPECT_THAT(finding->what, HasSubstr("correlation of 0.15"));
  EXPECT_THAT(finding->advice, HasSubstr("atelier template --frame"));
}

TEST(InsideBody, FewTrianglesInside_GiveNoFinding) {
  const std::vector<TrackedFrameFigures> frames = {{0, 0.9, 0.8, 0}, {1, 0.9, 0.8, 0.01}};
  EXPECT_FALSE(inside_body("lower", frames));
  EXPECT_FALSE(inside_body("lower", {}));
}

TEST(InsideBody, FramesWithManyTrianglesInside_GiveOneFinding) {
  const std::vector<TrackedFrameFigures> frames = {
      {4, 0.9, 0.8, 0.02}, {5, 0.9, 0.8, 0.034}, {6, 0.9, 0.8, 0.001}, {7, 0.9, 0.8, 0.011}};
  const auto finding = inside_body("lower", frames);
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->code, "inside-body");
  EXPECT_EQ(finding->place, "lower");
  EXPECT_THAT(finding->what,
              HasSubstr("up to 3.4% of it lies inside the body, in 3 of 4 frames (4, 5, 7)"));
}

}  // namespace
}  // namespace atelier
