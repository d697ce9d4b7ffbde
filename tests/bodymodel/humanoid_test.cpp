#include "bodymodel/humanoid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/motion_bvh.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::person_skeleton;
using fixtures::PersonNames;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// The same 21 joints as several rigs name them.
const PersonNames kSmpl = {
    "pelvis",         "left_hip",    "left_knee",     "left_ankle", "left_foot",  "right_hip",
    "right_knee",     "right_ankle", "right_foot",    "spine1",     "spine2",     "neck",
    "head",           "left_collar", "left_shoulder", "left_elbow", "left_wrist", "right_collar",
    "right_shoulder", "right_elbow", "right_wrist"};
const PersonNames kUnreal = {
    "pelvis",     "thigh_l",    "calf_l",   "foot_l",     "ball_l",     "thigh_r",    "calf_r",
    "foot_r",     "ball_r",     "spine_01", "spine_02",   "neck_01",    "head",       "clavicle_l",
    "upperarm_l", "lowerarm_l", "hand_l",   "clavicle_r", "upperarm_r", "lowerarm_r", "hand_r"};
const PersonNames kPoser = {"hip",    "lThigh",   "lShin",  "lFoot",    "lToe",  "rThigh",
                            "rShin",  "rFoot",    "rToe",   "abdomen",  "chest", "neck",
                            "head",   "lCollar",  "lShldr", "lForeArm", "lHand", "rCollar",
                            "rShldr", "rForeArm", "rHand"};
const PersonNames kAsf = {"root",     "lfemur",    "ltibia",   "lfoot",     "ltoes",  "rfemur",
                          "rtibia",   "rfoot",     "rtoes",    "lowerback", "thorax", "lowerneck",
                          "head",     "lclavicle", "lhumerus", "lradius",   "lwrist", "rclavicle",
                          "rhumerus", "rradius",   "rwrist"};
const PersonNames kBiped = {
    "Bip01 Pelvis",    "Bip01 L Thigh", "Bip01 L Calf",     "Bip01 L Foot",     "Bip01 L Toe0",
    "Bip01 R Thigh",   "Bip01 R Calf",  "Bip01 R Foot",     "Bip01 R Toe0",     "Bip01 Spine",
    "Bip01 Spine1",    "Bip01 Neck",    "Bip01 Head",       "Bip01 L Clavicle", "Bip01 L UpperArm",
    "Bip01 L Forearm", "Bip01 L Hand",  "Bip01 R Clavicle", "Bip01 R UpperArm", "Bip01 R Forearm",
    "Bip01 R Hand"};

void expect_person(const Humanoid& person) {
  EXPECT_EQ(person.spine, (std::vector<int>{0, 9, 10}));
  EXPECT_EQ(person.neck, (std::vector<int>{11, 12}));
  for (int side = 0; side < 2; ++side) {
    const Leg& leg = person.legs[side];
    EXPECT_EQ(leg.hip, 1 + 4 * side);
    EXPECT_EQ(leg.knee, 2 + 4 * side);
    EXPECT_EQ(leg.ankle, 3 + 4 * side);
    EXPECT_EQ(leg.toe, 4 + 4 * side);
    const Arm& arm = person.arms[side];
    EXPECT_EQ(arm.collar, 13 + 4 * side);
    EXPECT_EQ(arm.shoulder, 14 + 4 * side);
    EXPECT_EQ(arm.elbow, 15 + 4 * side);
    EXPECT_EQ(arm.wrist, 16 + 4 * side);
  }
}

TEST(Humanoid, NamesOfManyRigs_AreRecognized) {
  for (const PersonNames& names :
       {fixtures::mixamo_names(), kSmpl, kUnreal, kPoser, kAsf, kBiped}) {
    SCOPED_TRACE(names[1]);
    const std::optional<Humanoid> person = find_humanoid(person_skeleton(names));
    ASSERT_TRUE(person.has_value());
    expect_person(*person);
  }
}

TEST(Humanoid, NamePrefixes_AreIgnored) {
  PersonNames names = fixtures::mixamo_names();
  for (std::string& name : names) {
    name = "mixamorig:" + name;
  }
  expect_person(recognised_humanoid(person_skeleton(names)));
}

TEST(Humanoid, UnknownNames_AreRecognizedByTopology) {
  PersonNames names;
  for (int j = 0; j < 21; ++j) {
    names.push_back("joint_" + std::to_string(j));
  }
  expect_person(recognised_humanoid(person_skeleton(names)));
}

TEST(Humanoid, Fingers_AreRecognizedByName) {
  EXPECT_EQ(role_of_name("LeftHandThumb1").role, "thumb_1");
  EXPECT_EQ(role_of_name("left_index3").role, "index_3");
  EXPECT_EQ(role_of_name("finger5-2.R").role, "little_2");
  EXPECT_EQ(role_of_name("finger5-2.R").side, 1);
  EXPECT_EQ(role_of_name("middle_01_l").role, "middle_1");
  EXPECT_EQ(role_of_name("LThumb").role, "thumb_1");
  EXPECT_EQ(role_of_name("LeftInHandIndex").role, "");
  EXPECT_EQ(role_of_name("metacarpal1.L").role, "");
}

TEST(Humanoid, MeaninglessNames_HaveNoRole) {
  for (const char* name : {"", "LHipJoint", "pelvis.L", "upperleg02.L", "breast.L", "tongue00",
                           "__UpLeg_L", "lowerarm02.R", "levator06.L"}) {
    EXPECT_EQ(role_of_name(name).role, "") << name;
  }
}

TEST(Humanoid, Joints_GetSmplNames) {
  Skeleton skeleton = person_skeleton(kUnreal);
  const Skeleton renamed = with_smpl_names(skeleton, recognised_humanoid(skeleton));
  EXPECT_NO_THROW(check_skeleton(renamed));
  for (const char* name : {"pelvis", "neck", "head", "left_hip", "right_ankle", "left_foot",
                           "left_collar", "right_shoulder", "left_elbow", "right_wrist"}) {
    EXPECT_GE(find_joint(renamed, name), 0) << name;
  }
  EXPECT_EQ(find_joint(renamed, "left_knee"), 2);
  const Skeleton smpl = person_skeleton(kSmpl);
  EXPECT_EQ(with_smpl_names(smpl, recognised_humanoid(smpl)).names, smpl.names);
}

TEST(Humanoid, LegLength_IsHipToAnkle) {
  const Skeleton skeleton = person_skeleton();
  EXPECT_NEAR(leg_length(skeleton, recognised_humanoid(skeleton)), 0.83, 0.001);
}

TEST(Humanoid, EveryRealMotion_HasAPerson) {
  const std::filesystem::path root = fixtures::test_data_root();
  if (!std::filesystem::exists(root / "mocap_bvh")) {
    GTEST_SKIP() << "no test data at " << root;
  }
  for (const char* folder : {"mocap_bvh", "makehuman"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() == ".bvh") {
        const MotionClip clip = read_bvh(entry.path());
        EXPECT_TRUE(find_humanoid(clip.skeleton).has_value()) << entry.path();
      }
    }
  }
}

TEST(Humanoid, NonHumanSkeleton_IsRefused) {
  EXPECT_THAT([] { recognised_humanoid(fixtures::synthetic_body().skeleton, "fox.glb"); },
              ThrowsMessage<DataError>(::testing::AllOf(HasSubstr("fox.glb"),
                                                        HasSubstr("joints that match no person"),
                                                        HasSubstr("root, spine, head"))));
}

TEST(Humanoid, DisconnectedLegNames_AreRefusedForTopology) {
  Skeleton skeleton = person_skeleton();
  std::swap(skeleton.names[2], skeleton.names[6]);  // the knees
  // By name the left shin hangs on the right thigh; by topology the person is still there.
  expect_person(recognised_humanoid(skeleton));
}

}  // namespace
}  // namespace atelier
