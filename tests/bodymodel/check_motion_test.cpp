#include "bodymodel/check_motion.h"

#include <algorithm>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/formats/motion_file.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using fixtures::person_clip;
using ::testing::HasSubstr;

bool has(const std::vector<Finding>& findings, const std::string& code) {
  return std::any_of(findings.begin(), findings.end(),
                     [&](const Finding& finding) { return finding.code == code; });
}

TEST(DoubtMotion, PersonWhoWalks_IsNotDoubted) {
  EXPECT_TRUE(check_motion(person_clip()).empty());
  MotionClip slow = person_clip();  // a metre a frame, and a frame a second
  slow.motion.fps = 1;
  for (std::size_t i = 0; i < slow.motion.poses.size(); ++i) {
    slow.motion.poses[i].root_translation.x() = 1.2 * static_cast<double>(i);
  }
  EXPECT_TRUE(check_motion(slow).empty());
}

TEST(DoubtMotion, Leaps_AreNamedByTheFirstFrame) {
  MotionClip clip = person_clip();
  clip.motion.poses[2].root_translation.x() += 500;
  const std::vector<Finding> findings = check_motion(clip);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, "motion-jump");
  EXPECT_EQ(findings[0].what, "the root leaps 2 times, first by 500 m before frame 2");
  clip.motion.frame_ids = {0, 1, 2000, 4000, 4001};  // in a minute
  EXPECT_TRUE(check_motion(clip).empty());
}

TEST(DoubtMotion, BoneOfNoPerson_IsNamed) {
  MotionClip clip = person_clip();
  clip.skeleton.offsets.row(8) << 50, 0, 0;
  const std::vector<Finding> findings = check_motion(clip);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, "motion-bone");
  EXPECT_THAT(findings[0].what, HasSubstr(clip.skeleton.names[8] + " is 50 m from its parent"));
}

TEST(DoubtMotion, BvhInRadians_IsDoubted) {
  const fixtures::TemporaryDirectory folder;
  write_bvh(folder / "degrees.bvh", person_clip());
  EXPECT_FALSE(has(read_motion_file(folder / "degrees.bvh").findings, "motion-radians"));
  MotionClip clip = person_clip();
  for (Pose& pose : clip.motion.poses) {
    pose.rotations *= std::numbers::pi / 180;  // small ones are their Euler angles
  }
  write_bvh(folder / "radians.bvh", clip);
  EXPECT_TRUE(has(read_motion_file(folder / "radians.bvh").findings, "motion-radians"));
}

}  // namespace
}  // namespace atelier
