// An outside judge: where three.js puts the joints of BVH files that we write. three.js adds the
// root's OFFSET to its positions and reads ':' in names as a path.

#include <gtest/gtest.h>

#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/kinematics.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/support/outside_judge.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

TEST(BvhJudge, EveryJoint_StandsInThreeJsWhereItDoesHere) {
  ATELIER_NEEDS_JUDGE("three");
  MotionClip clip;
  clip.skeleton = fixtures::synthetic_body().skeleton;
  clip.skeleton.offsets.row(0) = Eigen::RowVector3d(0.1, 0.92, -0.2);
  for (std::string& name : clip.skeleton.names) {
    name = "mixamorig:" + name;
  }
  clip.motion.fps = 4;
  for (int frame = 0; frame < 3; ++frame) {
    clip.motion.poses.push_back(fixtures::random_pose(clip.skeleton, frame));
    clip.motion.frame_ids.push_back(frame);
  }
  const fixtures::TemporaryDirectory folder;
  write_bvh(folder / "a.bvh", clip);
  const fixtures::Judgement found =
      fixtures::judged("three.mjs", {"bvh", (folder / "a.bvh").string(), "0", "0.25"});
  for (const auto& [frame, time] : {std::pair(0, "0"), std::pair(1, "0.25")}) {
    const Points joints =
        forward_kinematics(clip.skeleton, clip.motion.poses[static_cast<std::size_t>(frame)])
            .positions;
    for (std::size_t j = 0; j < clip.skeleton.names.size(); ++j) {
      const std::string name = "mixamorig_" + clip.skeleton.names[j].substr(10);
      ASSERT_TRUE(found.contains(name + "@" + time)) << name;
      const std::vector<double>& there = found.at(name + "@" + time);
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(there[static_cast<std::size_t>(axis)],
                    100 * joints(static_cast<Index>(j), axis), 1e-3)
            << name << " at " << time;
      }
    }
  }
}

}  // namespace
}  // namespace atelier
