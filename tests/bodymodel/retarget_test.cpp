#include "bodymodel/retarget/retarget.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/makehuman.h"
#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/retarget_contacts.h"
#include "bodymodel/rotation.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::person_body;
using fixtures::person_clip;
using fixtures::person_skeleton;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

RetargetOptions plain() {
  RetargetOptions options;
  options.keep_contacts = false;
  options.ground = false;
  options.drop_t_pose = false;
  return options;
}

TEST(Retarget, SameSkeleton_GivesTheSameMotion) {
  const MotionClip clip = person_clip();
  const Retargeted result = retarget(clip, person_body(clip.skeleton), {}, plain());
  EXPECT_NEAR(result.scale, 1, 1e-12);
  EXPECT_EQ(result.reference_frame, -1);
  for (std::size_t i = 0; i < clip.motion.poses.size(); ++i) {
    EXPECT_LT((result.motion.poses[i].rotations - clip.motion.poses[i].rotations).norm(), 1e-9);
    EXPECT_LT(
        (result.motion.poses[i].root_translation - clip.motion.poses[i].root_translation).norm(),
        1e-9);
  }
}

TEST(Retarget, OtherRestPose_GivesTheSamePostures) {
  // A target whose joints have rest rotations and whose arms hang: postures must be the clip's.
  const MotionClip clip = person_clip();
  Skeleton target = person_skeleton();
  target.rest_rotations = Points::Zero(21, 3);
  target.rest_rotations.row(14) << 0, 0, -1.0;  // arms down
  target.rest_rotations.row(18) << 0, 0, 1.0;
  target.rest_rotations.row(2) << 0.2, 0, 0;  // a bent knee at rest
  const Retargeted result = retarget(clip, person_body(target), {}, plain());
  for (std::size_t i = 0; i < clip.motion.poses.size(); ++i) {
    const Points was = forward_kinematics(clip.skeleton, clip.motion.poses[i]).positions;
    const Points is = forward_kinematics(target, result.motion.poses[i]).positions;
    for (const int joint : {2, 3, 6, 7, 12, 15, 16, 19, 20}) {
      EXPECT_LT((is.row(joint) - was.row(joint)).norm(), 2e-3)
          << "frame " << i << " joint " << joint;
    }
  }
}

// Arms hang in the clip and on the body, not in the clip's rest pose: a frame is the reference.
TEST(Retarget, HeadBowedInTheReferenceFrame_IsBowedOnTheBody) {
  MotionClip clip = person_clip();
  for (Pose& pose : clip.motion.poses) {
    pose.rotations.row(12) << 0.5, 0, 0;
    pose.rotations.row(14) << 0, 0, -1.4;
    pose.rotations.row(18) << 0, 0, 1.4;
  }
  Skeleton target = person_skeleton();
  target.rest_rotations = Points::Zero(21, 3);
  target.rest_rotations.row(14) << 0, 0, -1.4;
  target.rest_rotations.row(18) << 0, 0, 1.4;
  const Retargeted result = retarget(clip, person_body(target), {}, plain());
  ASSERT_GE(result.reference_frame, 0);
  for (const Pose& pose : result.motion.poses) {
    const JointFrames frames = forward_kinematics(target, pose);
    EXPECT_LT((frames.rotations[12] - rotation_matrix({0.5, 0, 0})).norm(), 1e-9);
    EXPECT_LT((frames.rotations[11] - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  }
}

TEST(Retarget, BodyTwiceAsLarge_TakesStepsTwiceAsLong) {
  const MotionClip clip = person_clip();
  Skeleton target = person_skeleton();
  target.offsets *= 2;
  const Retargeted result = retarget(clip, person_body(target), {}, plain());
  EXPECT_NEAR(result.scale, 2, 1e-12);
  const Eigen::Vector3d step =
      result.motion.poses[4].root_translation - result.motion.poses[0].root_translation;
  EXPECT_NEAR(step.z(), 2 * 0.08, 1e-9);
}

TEST(Retarget, AdditionalSpineJoints_ShareTheBend) {
  MotionClip clip = person_clip();
  for (Pose& pose : clip.motion.poses) {
    pose.rotations.setZero();
    pose.rotations.row(10) << 0.6, 0, 0;  // the chest leans forward
  }
  // A target with one more joint half-way up the spine.
  Skeleton target = person_skeleton();
  target.names.insert(target.names.begin() + 10, "SpineHalf");
  target.parents.insert(target.parents.begin() + 10, 9);
  for (std::size_t j = 11; j < target.parents.size(); ++j) {
    target.parents[j] += target.parents[j] >= 10 ? 1 : 0;
  }
  target.parents[11] = 10;
  Points offsets(22, 3);
  offsets << target.offsets.topRows(10), 0.5 * target.offsets.row(10), 0.5 * target.offsets.row(10),
      target.offsets.bottomRows(10);
  target.offsets = offsets;
  const Retargeted result = retarget(clip, person_body(target), {}, plain());
  const JointFrames frames = forward_kinematics(target, result.motion.poses[0]);
  // The chest has the whole lean, the new joint part of it.
  EXPECT_LT((frames.rotations[11] - rotation_matrix({0.6, 0, 0})).norm(), 1e-9);
  const double part = rotation_vector(frames.rotations[10]).x();
  EXPECT_GT(part, 0.1);
  EXPECT_LT(part, 0.5);
}

TEST(Retarget, Frames_AreResampled) {
  RetargetOptions options = plain();
  options.fps = 60;
  const Retargeted result = retarget(person_clip(), person_body(person_skeleton()), {}, options);
  EXPECT_EQ(result.motion.poses.size(), 9u);
  EXPECT_EQ(result.motion.fps, 60);
  EXPECT_EQ(result.contacts.size(), 9u);
}

TEST(Retarget, CalibrationPose_IsLeftOutAndReported) {
  MotionClip clip = person_clip();
  for (std::size_t i = 1; i < clip.motion.poses.size(); ++i) {
    for (const int joint : {14, 18, 1, 5, 15, 19}) {
      clip.motion.poses[i].rotations.row(joint).array() += 0.8;
    }
  }
  RetargetOptions options = plain();
  options.drop_t_pose = true;
  const Retargeted result = retarget(clip, person_body(clip.skeleton), {}, options);
  EXPECT_EQ(result.motion.poses.size(), 4u);
  EXPECT_EQ(result.reference_frame, 0);
  ASSERT_EQ(result.findings.size(), 1u);
  EXPECT_EQ(result.findings[0].code, "motion-t-pose");
}

// The zombie's actor starts in a T-pose and moves on from there: a pose of the motion, which stays.
TEST(Retarget, ActedTPose_IsKept) {
  ATELIER_TEST_FILE(path, "mocap_bvh/animated_drawings/fair1/zombie.bvh");
  const MotionClip clip = read_bvh(path);
  DefaultHumanOptions human = female_human();
  human.shape_basis = false;
  const BodyModel model = default_human(human);
  RetargetOptions options;
  options.keep_contacts = false;
  const Retargeted result = retarget(clip, model, {}, options);
  EXPECT_EQ(result.motion.poses.size(), clip.motion.poses.size());
  for (const Finding& finding : result.findings) {
    EXPECT_NE(finding.code, "motion-t-pose");
  }
  const Points joints = forward_kinematics(model.skeleton, result.motion.poses[0]).positions;
  const auto height = [&](const char* name) { return joints(find_joint(model.skeleton, name), 1); };
  EXPECT_NEAR(height("left_wrist"), height("left_shoulder"), 0.15);
  EXPECT_NEAR(height("right_wrist"), height("right_shoulder"), 0.15);
}

TEST(Retarget, FourLegs_AreReportedAndACrawlIsNot) {
  MotionClip animal = person_clip();
  for (const int joint : {9, 10, 11}) {  // the trunk lies level
    std::swap(animal.skeleton.offsets(joint, 1), animal.skeleton.offsets(joint, 2));
  }
  animal.skeleton.offsets.row(14) << 0, -0.3, 0;  // forelegs
  animal.skeleton.offsets.row(18) << 0, -0.3, 0;
  const Retargeted result = retarget(animal, person_body(person_skeleton()), {}, plain());
  ASSERT_EQ(result.findings.size(), 1u);
  EXPECT_EQ(result.findings[0].severity, Severity::Warning);
  EXPECT_EQ(result.findings[0].code, "retarget-posture");
  EXPECT_THAT(result.findings[0].advice, HasSubstr("four-legged"));

  MotionClip crawl = person_clip();  // a person at rest, bent at the hips in every frame
  for (Pose& pose : crawl.motion.poses) {
    pose.rotations.row(0) << 0.5 * std::numbers::pi, 0, 0;
    pose.rotations.row(1) << -0.5 * std::numbers::pi, 0, 0;
    pose.rotations.row(5) << -0.5 * std::numbers::pi, 0, 0;
  }
  EXPECT_TRUE(retarget(crawl, person_body(person_skeleton()), {}, plain()).findings.empty());
}

/// A motion mirrored in x, its names kept, as left-handed worlds and webcams have it.
MotionClip mirror_image(MotionClip clip) {
  clip.skeleton.offsets.col(0) *= -1;
  if (clip.skeleton.rest_rotations.rows() > 0) {
    clip.skeleton.rest_rotations.rightCols(2) *= -1;
  }
  for (Pose& pose : clip.motion.poses) {
    pose.root_translation.x() *= -1;
    pose.rotations.rightCols(2) *= -1;
  }
  return clip;
}

TEST(Retarget, MirrorImageWithItsNamesKept_IsReported) {
  const BodyModel model = person_body(person_skeleton());
  EXPECT_TRUE(retarget(person_clip(), model, {}, plain()).findings.empty());
  const MotionClip mirrored = mirror_image(person_clip());
  const Retargeted result = retarget(mirrored, model, {}, plain());
  ASSERT_EQ(result.findings.size(), 1U);
  EXPECT_EQ(result.findings[0].code, "motion-mirrored");
  MotionClip renamed = mirrored;  // left where it is now
  for (std::string& name : renamed.skeleton.names) {
    if (name.starts_with("Left")) {
      name = "Right" + name.substr(4);
    } else if (name.starts_with("Right")) {
      name = "Left" + name.substr(5);
    }
  }
  EXPECT_TRUE(retarget(renamed, model, {}, plain()).findings.empty());
}

TEST(Retarget, PlantedFeet_StayInPlace) {
  // A clip whose root drifts over a foot that should stand: contacts must come out still.
  MotionClip clip = person_clip();
  clip.motion.poses.clear();
  clip.motion.frame_ids.clear();
  for (int i = 0; i < 30; ++i) {
    Pose pose = rest_pose(clip.skeleton);
    pose.root_translation = {0.003 * std::sin(0.4 * i), -0.03, 0.004 * std::cos(0.3 * i)};
    pose.rotations.row(1) << -0.3, 0, 0;
    pose.rotations.row(2) << 0.6, 0, 0;
    pose.rotations.row(3) << -0.3, 0, 0;
    clip.motion.poses.push_back(pose);
    clip.motion.frame_ids.push_back(i);
  }
  RetargetOptions options;
  options.ground = false;
  Skeleton skeleton = clip.skeleton;
  skeleton.offsets *= 1.01;  // another person: what stands on its own skeleton is left alone
  const Retargeted result = retarget(clip, person_body(skeleton), {}, options);
  Eigen::RowVector3d low = Eigen::RowVector3d::Constant(1e9);
  Eigen::RowVector3d high = -low;
  for (std::size_t i = 0; i < result.motion.poses.size(); ++i) {
    EXPECT_TRUE(result.contacts[i][0]);
    const Eigen::RowVector3d toe =
        forward_kinematics(skeleton, result.motion.poses[i]).positions.row(4);
    low = low.cwiseMin(toe);
    high = high.cwiseMax(toe);
  }
  EXPECT_LT(high.x() - low.x(), 1e-6);
  EXPECT_LT(high.z() - low.z(), 1e-6);
}

TEST(Retarget, AnkleTarget_IsReached) {
  const Skeleton skeleton = person_skeleton();
  const Humanoid person = recognised_humanoid(skeleton);
  Pose pose = rest_pose(skeleton);
  pose.rotations.row(1) << -0.5, 0.1, 0;
  pose.rotations.row(2) << 0.9, 0, 0;
  pose.rotations.row(3) << -0.2, 0.1, 0;
  const JointFrames before = forward_kinematics(skeleton, pose);
  const Eigen::Vector3d wanted =
      before.positions.row(3).transpose() + Eigen::Vector3d(0.04, 0.05, -0.06);
  const Pose moved = with_ankle_at(pose, skeleton, person.legs[0], wanted);
  const JointFrames after = forward_kinematics(skeleton, moved);
  EXPECT_LT((after.positions.row(3).transpose() - wanted).norm(), 1e-9);
  EXPECT_LT((after.rotations[3] - before.rotations[3]).norm(), 1e-9);  // the foot keeps its turn
  EXPECT_EQ((after.positions.row(7) - before.positions.row(7)).norm(), 0);
}

TEST(Retarget, UnreachableAnkleTarget_StraightensTheLeg) {
  const Skeleton skeleton = person_skeleton();
  const Humanoid person = recognised_humanoid(skeleton);
  const Pose moved =
      with_ankle_at(rest_pose(skeleton), skeleton, person.legs[0], Eigen::Vector3d(0.09, -3, 0));
  const JointFrames after = forward_kinematics(skeleton, moved);
  EXPECT_TRUE(after.positions.allFinite());
  EXPECT_NEAR((after.positions.row(3) - after.positions.row(1)).norm(), 0.83, 0.002);
}

// MakeHuman's body with its own rig, without macros.
MakeHumanBody makehuman(const std::filesystem::path& root) {
  MakeHumanFiles files;
  files.base = root / "makehuman/base/base.obj";
  files.rig = root / "makehuman/base/default.mhskel";
  files.weights = root / "makehuman/base/default_weights.mhw";
  return read_makehuman(files);
}

// Where a head that looks to +Z at rest looks.
Eigen::Vector3d look(const BodyModel& model, int head, const Pose& pose) {
  const std::size_t joint = static_cast<std::size_t>(head);
  return forward_kinematics(model.skeleton, pose).rotations[joint] *
         forward_kinematics(model.skeleton, rest_pose(model.skeleton))
             .rotations[joint]
             .transpose() *
         Eigen::Vector3d::UnitZ();
}

// Every BVH of the data: captures, and MakeHuman's poses and animations.
TEST(Retarget, EveryRealMotion_MovesMakeHumanAndTheDefaultHuman) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  const std::filesystem::path root = fixtures::test_data_root();
  DefaultHumanOptions human = female_human();
  human.shape_basis = false;
  const BodyModel bodies[] = {makehuman(root).model, default_human(human)};
  const int heads[] = {recognised_humanoid(bodies[0].skeleton, "makehuman").neck.back(),
                       recognised_humanoid(bodies[1].skeleton, "default human").neck.back()};
  RetargetOptions options;
  options.fps = 5;  // keeps the test short
  int files = 0;
  int mirrored = 0;  // of those whose mirror image is told as one
  for (const char* folder : {"mocap_bvh", "makehuman"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() != ".bvh") {
        continue;
      }
      ++files;
      const MotionClip clip = read_bvh(entry.path());
      std::vector<Pose> on_makehuman;
      for (const BodyModel& model : bodies) {
        SCOPED_TRACE(entry.path().string() + " on " + model.name);
        const Retargeted result = retarget(clip, model, {}, options);
        if (&model == bodies) {
          on_makehuman = result.motion.poses;
        } else {  // both look to the same side, whichever frame was the reference
          for (std::size_t i = 0; i < on_makehuman.size(); ++i) {
            EXPECT_GT(look(bodies[0], heads[0], on_makehuman[i])
                          .dot(look(model, heads[1], result.motion.poses[i])),
                      std::cos(0.1));
          }
        }
        const std::vector<Pose>& poses = result.motion.poses;
        ASSERT_FALSE(poses.empty());
        EXPECT_GT(result.scale, 0.6);
        EXPECT_LT(result.scale, 1.4);
        for (const Finding& finding : result.findings) {
          EXPECT_NE(finding.code, "retarget-scale");
          EXPECT_NE(finding.code, "motion-mirrored");
        }
        const MotionClip other = mirror_image(clip);
        if (&model != bodies) {  // of one body, which does not matter here
          const std::vector<Finding> said = retarget(other, model, {}, options).findings;
          mirrored += std::any_of(said.begin(), said.end(), [](const Finding& finding) {
            return finding.code == "motion-mirrored";
          });
        }
        for (const std::size_t frame : {std::size_t{0}, poses.size() / 2, poses.size() - 1}) {
          const Points posed = skin_vertices(model, poses[frame]);
          EXPECT_TRUE(posed.allFinite());
          EXPECT_GT(posed.col(1).minCoeff(), -0.12);
          const double height = posed.col(1).maxCoeff() - posed.col(1).minCoeff();
          EXPECT_GT(height, 0.3);
          EXPECT_LT(height, 2.3);  // arms up
        }
      }
    }
  }
  EXPECT_GE(files, 31);
  EXPECT_GE(mirrored, 0.8 * files) << "but those without toes";
  RecordProperty("files", files);
  RecordProperty("mirrored", mirrored);
}

TEST(Retarget, ImplausibleScale_IsReportedWithItsNumber) {
  MotionClip clip = person_clip();
  clip.skeleton.offsets *= 100;  // centimetres that nobody said
  for (Pose& pose : clip.motion.poses) {
    pose.root_translation *= 100;
  }
  const Retargeted result = retarget(clip, person_body(person_skeleton()), {}, plain());
  ASSERT_EQ(result.findings.size(), 1u);
  EXPECT_EQ(result.findings[0].severity, Severity::Warning);
  EXPECT_EQ(result.findings[0].code, "retarget-scale");
  EXPECT_THAT(result.findings[0].what,
              HasSubstr("legs of 83 m in the motion and of 0.83 m on the body: steps are scaled by "
                        "0.01"));
  EXPECT_THAT(result.findings[0].advice, HasSubstr("--motion.metres-per-unit"));
  EXPECT_TRUE(
      retarget(person_clip(), person_body(person_skeleton()), {}, plain()).findings.empty());
}

TEST(Retarget, Walk_KeepsItsFeetOnTheGround) {
  ATELIER_TEST_FILE(path, "mocap_bvh/bvh_python/test_freebvh.bvh");
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  const MakeHumanBody body = makehuman(fixtures::test_data_root());
  const Retargeted result = retarget(read_bvh(path), body.model);
  const Humanoid person = recognised_humanoid(body.model.skeleton);
  int standing = 0;
  double slide = 0;
  for (std::size_t i = 1; i < result.motion.poses.size(); ++i) {
    for (std::size_t side = 0; side < 2; ++side) {
      if (result.contacts[i][side] && result.contacts[i - 1][side]) {
        ++standing;
        const int toe = person.legs[side].toe;
        const Points now =
            forward_kinematics(body.model.skeleton, result.motion.poses[i]).positions;
        const Points before =
            forward_kinematics(body.model.skeleton, result.motion.poses[i - 1]).positions;
        Eigen::RowVector3d moved = now.row(toe) - before.row(toe);
        moved.y() = 0;
        slide = std::max(slide, moved.norm());
      }
    }
  }
  EXPECT_GT(standing, 30);
  EXPECT_LT(slide, 0.002);  // metres a frame
}

TEST(Retarget, OwnSkeleton_IsTakenAsItIsWithContacts) {
  MotionClip clip = person_clip();
  for (std::size_t i = 0; i < clip.motion.poses.size(); ++i) {  // a foot that slides
    clip.motion.poses[i].root_translation.x() = 0.002 * static_cast<double>(i);
  }
  RetargetOptions options;
  options.ground = false;
  const Retargeted result = retarget(clip, person_body(clip.skeleton), {}, options);
  EXPECT_EQ(result.scale, 1);
  for (std::size_t i = 0; i < clip.motion.poses.size(); ++i) {
    EXPECT_EQ(result.motion.poses[i].rotations, clip.motion.poses[i].rotations);
    EXPECT_EQ(result.motion.poses[i].root_translation, clip.motion.poses[i].root_translation);
  }
}

TEST(Retarget, LegsWithoutLength_AreRefused) {
  MotionClip clip = person_clip();
  clip.skeleton.offsets.setZero();
  EXPECT_THAT([&] { retarget(clip, person_body(person_skeleton())); },
              ThrowsMessage<DataError>(HasSubstr("legs of 0 m")));
}

TEST(Retarget, NonHumanMotion_IsRefused) {
  MotionClip clip = person_clip();
  clip.skeleton = fixtures::synthetic_body().skeleton;
  clip.name = "fox";
  clip.motion.poses.resize(1);
  clip.motion.poses[0] = rest_pose(clip.skeleton);
  EXPECT_THAT([&] { retarget(clip, person_body(person_skeleton())); },
              ThrowsMessage<DataError>(HasSubstr("joints that match no person")));
}

TEST(Retarget, NonHumanBody_IsRefused) {
  EXPECT_THAT([&] { retarget(person_clip(), fixtures::synthetic_body()); },
              ThrowsMessage<DataError>(HasSubstr("synthetic")));
}

TEST(Retarget, Options_AreDescribed) {
  RetargetOptions options;
  OptionTable table = describe(options);
  EXPECT_EQ(set_option(table, "fps", "25"), "");
  EXPECT_EQ(options.fps, 25);
  EXPECT_NE(set_option(table, "contact_speed", "-1"), "");
}

}  // namespace
}  // namespace atelier
