#include "bodymodel/motion_clip.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/euler.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/motion_resample.h"
#include "bodymodel/rotation.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_person.h"

namespace atelier {
namespace {

using fixtures::person_clip;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(MotionClip, Units_AreGuessedFromTheLegs) {
  for (const double unit : {1.0, 0.1, 0.0254 / 0.45, 0.0254, 0.01, 0.001}) {
    MotionClip clip = person_clip();
    clip.skeleton.offsets /= unit;
    EXPECT_NEAR(guess_metres_per_unit(clip, 'y'), unit, 1e-12);
  }
}

TEST(MotionClip, UnknownUnit_IsScaledToAnAdult) {
  MotionClip clip = person_clip();
  clip.skeleton.offsets /= 0.0379;
  const double unit = guess_metres_per_unit(clip, 'y');
  EXPECT_NEAR(unit, 0.0379, 0.002);
}

TEST(MotionClip, ZUpMotion_IsTurnedToYUp) {
  MotionClip clip = person_clip();
  // The same person as a Z-up program writes it: (x, y, z) -> (x, -z, y), in centimetres.
  const Eigen::Matrix3d tip = axis_rotation(0, std::numbers::pi / 2);
  MotionClip tipped = clip;
  tipped.skeleton.offsets = 100 * clip.skeleton.offsets * tip.transpose();
  for (Pose& pose : tipped.motion.poses) {
    pose.root_translation = 100 * tip * pose.root_translation;
    pose.rotations = (pose.rotations * tip.transpose()).eval();
  }
  EXPECT_EQ(guess_up_axis(clip), 'y');
  EXPECT_EQ(guess_up_axis(tipped), 'z');
  const MotionClip back = in_metres_y_up(tipped);
  EXPECT_EQ(back.findings.size(), 2u);
  for (std::size_t i = 0; i < clip.motion.poses.size(); ++i) {
    EXPECT_LT((forward_kinematics(back.skeleton, back.motion.poses[i]).positions -
               forward_kinematics(clip.skeleton, clip.motion.poses[i]).positions)
                  .norm(),
              1e-12);
  }
}

// A skeleton that rests along y, in a motion whose world has z up: root turned and carried there.
TEST(MotionClip, PeopleWhoStandInAWorldOfAnotherAxis_TurnIt) {
  MotionClip clip = person_clip();
  const Eigen::Matrix3d turn = axis_rotation(0, std::numbers::pi / 2);  // y to z
  const Eigen::Vector3d pelvis = clip.skeleton.offsets.row(0);
  for (Pose& pose : clip.motion.poses) {
    pose.rotations.row(0) = rotation_vector(turn * rotation_matrix(pose.rotations.row(0)));
    pose.root_translation = turn * (pelvis + pose.root_translation) - pelvis;
  }
  EXPECT_EQ(guess_up_axis(clip), 'z');
  MotionClip lying = clip;  // on the floor of a world with y up
  for (Pose& pose : lying.motion.poses) {
    pose.root_translation = Eigen::Vector3d(0, 0.1, -0.4) - pelvis;
  }
  EXPECT_EQ(guess_up_axis(lying), 'y');
}

TEST(MotionClip, FrameRates_AreRounded) {
  EXPECT_EQ(frame_rate(0.0083333), 120);
  EXPECT_EQ(frame_rate(0.041667), 24);
  EXPECT_NEAR(frame_rate(0.0334), 29.94, 0.01);
}

TEST(MotionClip, Resampling_KeepsTheMotion) {
  Motion motion;
  motion.fps = 120;
  const Eigen::RowVector3d turn(0.5, 1, -0.3);
  for (int i = 0; i <= 120; ++i) {
    Pose pose;
    pose.root_translation = {i / 120.0, 0, 0};
    pose.rotations = turn * (i / 120.0);
    motion.poses.push_back(pose);
    motion.frame_ids.push_back(i);
  }
  for (const double fps : {30.0, 24.0, 50.0, 240.0}) {
    const Motion result = resampled(motion, fps);
    ASSERT_EQ(result.poses.size(), static_cast<std::size_t>(fps) + 1);
    for (std::size_t i = 0; i < result.poses.size(); ++i) {
      const double at = static_cast<double>(i) / fps;
      EXPECT_NEAR(result.poses[i].root_translation.x(), at, 1e-9);
      EXPECT_LT((result.poses[i].rotations.row(0) - at * turn).norm(), 1e-9);
    }
  }
}

TEST(MotionClip, ResamplingToMoreFramesThanTheLimit_IsRefused) {
  Motion motion;
  motion.fps = 0.01;
  motion.poses.resize(1000);  // 27 hours
  EXPECT_THAT([&] { resampled(motion, 120); },
              ::testing::ThrowsMessage<DataError>(HasSubstr("11988001 frames at 120 a second")));
}

TEST(MotionClip, Interpolation_TakesTheShortWay) {
  const Eigen::Vector3d half =
      interpolated_rotation({0, 0, 3}, {0, 0, -3}, 0.5);  // 180 degrees between, through pi
  EXPECT_NEAR(std::abs(half.z()), std::numbers::pi, 1e-9);
}

TEST(MotionClip, SmoothPoses_InterpolateFramesWithContinuousSpeed) {
  Motion motion;
  motion.fps = 12;
  for (int i = 0; i < 9; ++i) {  // a spin beyond a whole turn, which gains speed and loses it
    Pose pose;
    const double t = i / 8.0;
    pose.root_translation = {t * t, 0, 0.1 * i};
    pose.rotations = Eigen::RowVector3d(0.1, 7 * t * t * (3 - 2 * t), 0);
    motion.poses.push_back(pose);
    motion.frame_ids.push_back(i);
  }
  for (int i = 0; i < 9; ++i) {
    const Pose pose = smooth_pose(motion, i / 12.0);
    const auto k = static_cast<std::size_t>(i);
    EXPECT_LT((pose.root_translation - motion.poses[k].root_translation).norm(), 1e-12);
    EXPECT_LT((rotation_matrix(pose.rotations.row(0).transpose()) -
               rotation_matrix(motion.poses[k].rotations.row(0).transpose()))
                  .norm(),
              1e-6);
  }
  const auto speed = [&](double from, double to) {
    const Eigen::Matrix3d a = rotation_matrix(smooth_pose(motion, from).rotations.row(0));
    const Eigen::Matrix3d b = rotation_matrix(smooth_pose(motion, to).rotations.row(0));
    return Eigen::Vector3d(rotation_vector(a.transpose() * b) / (to - from));
  };
  for (int i = 1; i < 8; ++i) {
    const double at = i / 12.0;
    EXPECT_LT((speed(at - 1e-4, at) - speed(at, at + 1e-4)).norm(), 0.02) << i;
  }
  EXPECT_LT((smooth_pose(motion, -1).root_translation - motion.poses[0].root_translation).norm(),
            1e-12);
  EXPECT_LT((smooth_pose(motion, 9).root_translation - motion.poses[8].root_translation).norm(),
            1e-12);
}

TEST(MotionClip, SteadyTurn_IsSmoothFromTheFirstFrame) {
  Motion motion;
  motion.fps = 10;
  for (int i = 0; i < 4; ++i) {
    Pose pose;
    pose.root_translation = {0.2 * i, 0, 0};
    pose.rotations = Eigen::RowVector3d(0, 0.3 * i, 0);
    motion.poses.push_back(pose);
    motion.frame_ids.push_back(i);
  }
  for (const double at : {0.02, 0.05, 0.17, 0.29}) {
    const Pose pose = smooth_pose(motion, at);
    EXPECT_NEAR(pose.root_translation.x(), 2 * at, 1e-12);
    EXPECT_NEAR(pose.rotations(0, 1), 3 * at, 2e-4);
  }
}

TEST(MotionClip, SmoothPoseOfAnEmptyMotion_IsRefused) {
  EXPECT_THROW(smooth_pose(Motion{}, 0), LogicError);
  Motion motion;
  motion.poses.emplace_back();
  EXPECT_THROW(smooth_pose(motion, 0), LogicError) << "no rate";
}

TEST(MotionClip, ResamplingToNothing_IsRefused) {
  EXPECT_THAT([] { resampled(Motion{}, 30); }, ThrowsMessage<LogicError>(HasSubstr("positive")));
  Motion motion;
  motion.fps = 30;
  EXPECT_THAT([&] { resampled(motion, 0); }, ThrowsMessage<LogicError>(HasSubstr("positive")));
}

TEST(MotionClip, InconsistentClips_AreRefused) {
  const auto refused = [](void (*spoil)(MotionClip&), const char* message) {
    MotionClip clip = person_clip();
    spoil(clip);
    EXPECT_THAT([&] { check_motion_clip(clip, "a.bvh"); },
                ThrowsMessage<DataError>(HasSubstr(message)));
  };
  refused([](MotionClip& c) { c.motion.fps = 0; }, "frame rate");
  refused([](MotionClip& c) { c.motion.fps = NAN; }, "frame rate");
  refused([](MotionClip& c) { c.motion.frame_ids.pop_back(); }, "one for each pose");
  refused([](MotionClip& c) { c.motion.frame_ids[1] = 0; }, "increasing frame ids");
  refused([](MotionClip& c) { c.motion.poses[2].rotations.conservativeResize(3, 3); },
          "one for each joint");
  refused([](MotionClip& c) { c.motion.poses[2].root_translation.x() = INFINITY; }, "frame 2");
  refused([](MotionClip& c) { c.end_sites.push_back({99, {0, 0, 0}}); }, "end site");
}

TEST(MotionClip, UnknownAxesAndUnits_AreRefused) {
  EXPECT_THAT(
      [] {
        in_metres_y_up(person_clip(), {0, 'x', 0});
      },
      ThrowsMessage<LogicError>(HasSubstr("up is 'y' or 'z'")));
  EXPECT_THAT(
      [] {
        in_metres_y_up(person_clip(), {-1, 'y', 0});
      },
      ThrowsMessage<LogicError>(HasSubstr("not negative")));
}

}  // namespace
}  // namespace atelier
