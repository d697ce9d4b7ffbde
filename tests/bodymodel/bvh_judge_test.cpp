// Outside judges: where three.js and Blender put the joints of BVH files that we write. three.js
// adds the root's OFFSET to its positions and reads ':' in names as a path.

#include <array>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/kinematics.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/support/outside_judge.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

/// A body of joints that turn at random for three frames of a quarter of a second.
MotionClip turning_clip() {
  MotionClip clip;
  clip.skeleton = fixtures::synthetic_body().skeleton;
  clip.skeleton.offsets.row(0) = Eigen::RowVector3d(0.1, 0.92, -0.2);
  clip.motion.fps = 4;
  for (int frame = 0; frame < 3; ++frame) {
    clip.motion.poses.push_back(fixtures::random_pose(clip.skeleton, frame));
    clip.motion.frame_ids.push_back(frame);
  }
  return clip;
}

/// Expects each joint of two frames, named as in the file, where `found` has it in `unit` metres.
void expect_joints(const MotionClip& clip, const std::vector<std::string>& names,
                   const std::array<std::string, 2>& frames, double unit,
                   const fixtures::Judgement& found) {
  for (std::size_t frame = 0; frame < frames.size(); ++frame) {
    const Points joints = forward_kinematics(clip.skeleton, clip.motion.poses[frame]).positions;
    for (std::size_t j = 0; j < names.size(); ++j) {
      const std::string key = names[j] + "@" + frames[frame];
      ASSERT_TRUE(found.contains(key)) << key;
      const std::vector<double>& there = found.at(key);
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(unit * there[static_cast<std::size_t>(axis)],
                    joints(static_cast<Index>(j), axis), 1e-5)
            << key;
      }
    }
  }
}

TEST(BvhJudge, EveryJoint_StandsInThreeJsWhereItDoesHere) {
  ATELIER_NEEDS_JUDGE("three");
  MotionClip clip = turning_clip();
  std::vector<std::string> names = clip.skeleton.names;
  for (std::size_t j = 0; j < names.size(); ++j) {
    clip.skeleton.names[j] = "mixamorig:" + names[j];
    names[j] = "mixamorig_" + names[j];
  }
  const fixtures::TemporaryDirectory folder;
  write_bvh(folder / "a.bvh", clip);
  expect_joints(clip, names, {"0", "0.25"}, 0.01,
                fixtures::judged("three.mjs", {"bvh", (folder / "a.bvh").string(), "0", "0.25"}));
}

TEST(BvhJudge, EveryJoint_StandsInBlenderWhereItDoesHere) {
  ATELIER_NEEDS_PROGRAM("blender");
  const MotionClip clip = turning_clip();
  const fixtures::TemporaryDirectory folder;
  write_bvh(folder / "a.bvh", clip);
  const fixtures::Judgement found =
      fixtures::judged_by_blender({"bvh", (folder / "a.bvh").string(), "1", "2"});
  EXPECT_NEAR(found.at("fps")[0], 4, 1e-3);
  expect_joints(clip, clip.skeleton.names, {"1", "2"}, 1, found);
}

}  // namespace
}  // namespace atelier
