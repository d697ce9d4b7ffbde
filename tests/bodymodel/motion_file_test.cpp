#include "bodymodel/formats/motion_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"
#include "core/unknown_value.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using fixtures::person_clip;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

MotionClip in_centimetres() {
  MotionClip clip = person_clip();
  clip.skeleton.offsets *= 100;
  for (Pose& pose : clip.motion.poses) {
    pose.root_translation *= 100;
  }
  return clip;
}

double legs(const MotionClip& clip) {
  return leg_length(clip.skeleton, recognised_humanoid(clip.skeleton));
}

TEST(MotionFile, EveryWrittenFormat_ReadsBackEqual) {
  const fixtures::TemporaryDirectory folder;
  MotionClip clip = person_clip();
  clip.motion.fps = 50;
  for (const char* name : {"a.bvh", "a.npz", "a.glb", "a.gltf"}) {
    SCOPED_TRACE(name);
    write_motion_file(folder / name, clip);
    const MotionClip back = read_motion_file(folder / name);
    ASSERT_EQ(back.motion.poses.size(), clip.motion.poses.size());
    EXPECT_EQ(back.motion.fps, clip.motion.fps);
    const Points was = forward_kinematics(clip.skeleton, clip.motion.poses[4]).positions;
    const Points is = forward_kinematics(back.skeleton, back.motion.poses[4]).positions;
    EXPECT_LT((is - was).cwiseAbs().maxCoeff(), 1e-4);
  }
  EXPECT_THROW(write_motion_file(folder / "a.fbx", clip), LogicError);
}

TEST(MotionFile, CentimetresInMetreFormats_AreRepairedAndReported) {
  const fixtures::TemporaryDirectory folder;
  for (const char* name : {"cm.npz", "cm.glb"}) {
    SCOPED_TRACE(name);
    write_motion_file(folder / name, in_centimetres());
    const MotionClip back = read_motion_file(folder / name);
    EXPECT_NEAR(legs(back), 0.83, 0.01);
    ASSERT_FALSE(back.findings.empty());
    EXPECT_EQ(back.findings.back().code, "motion-unit");
    EXPECT_THAT(back.findings.back().what, HasSubstr("one unit taken as 0.01 m"));
  }
}

TEST(MotionFile, GivenUnitAndRate_ApplyToNpz) {
  const fixtures::TemporaryDirectory folder;
  write_motion_file(folder / "m.npz", person_clip());
  EXPECT_TRUE(read_motion_file(folder / "m.npz").findings.empty());
  MotionFileOptions options;
  options.motion.metres_per_unit = 0.5;
  options.motion.fps = 24;
  const MotionClip child = read_motion_file(folder / "m.npz", options);
  EXPECT_NEAR(legs(child), 0.415, 0.01);
  EXPECT_EQ(child.motion.fps, 24);
}

TEST(MotionFile, AnimationThatAFormatOfOneMotionCannotHave_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  for (const char* name : {"a.bvh", "a.npz", "a.glb"}) {
    write_motion_file(folder / name, person_clip());
    MotionFileOptions options;
    for (const char* wanted : {"Walk", "2", "0"}) {
      options.motion.animation = wanted;
      EXPECT_THAT(
          [&] { read_motion_file(folder / name, options); },
          ThrowsMessage<UnknownValue>(HasSubstr(std::string("animation: '") + wanted + "'")))
          << name;
    }
    options.motion.animation = "1";
    EXPECT_EQ(read_motion_file(folder / name, options).motion.poses.size(),
              person_clip().motion.poses.size());
  }
}

TEST(MotionFile, PeopleBeyondAStage_AreRefused) {
  const fixtures::TemporaryDirectory folder;
  MotionClip clip = person_clip();
  clip.motion.poses[2].root_translation.x() = 1e6;
  for (const char* name : {"far.npz", "far.glb", "far.bvh"}) {
    SCOPED_TRACE(name);
    write_motion_file(folder / name, clip);
    EXPECT_THAT([&] { read_motion_file(folder / name); },
                ThrowsMessage<DataError>(HasSubstr("m from the origin")));
  }
}

TEST(MotionFile, OtherExtensions_AreRefused) {
  EXPECT_THAT([] { read_motion_file("walk.usd"); },
              ThrowsMessage<DataError>(HasSubstr("extension '.usd'")));
}

}  // namespace
}  // namespace atelier
