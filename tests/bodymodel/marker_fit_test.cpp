#include "bodymodel/formats/marker_fit.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/marker_head.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/rotation.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_markers.h"
#include "tests/support/finite_differences.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::joint_centre_names;
using fixtures::marked_person;
using fixtures::MarkedPerson;
using fixtures::opensim_names;
using fixtures::plug_in_gait_names;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

const Finding* finding(const MotionClip& clip, const std::string& code) {
  for (const Finding& f : clip.findings) {
    if (f.code == code) {
      return &f;
    }
  }
  return nullptr;
}

struct Errors {
  double joints = 0;  ///< m, mean over frames and the body's limb joints
  double worst = 0;   ///< m
  double bones = 0;   ///< largest relative error of thigh, shin, upper arm, forearm
};

Errors errors_of(const MarkerFit& fit, const MarkedPerson& person) {
  Errors errors;
  const char* joints[] = {"left_hip",   "right_hip",   "left_knee",     "right_knee",
                          "left_ankle", "right_ankle", "left_shoulder", "right_shoulder",
                          "left_elbow", "right_elbow", "left_wrist",    "right_wrist"};
  for (std::size_t f = 0; f < person.poses.size(); ++f) {
    const Points truth = forward_kinematics(person.skeleton, person.poses[f]).positions;
    const Points found = forward_kinematics(fit.clip.skeleton, fit.clip.motion.poses[f]).positions;
    for (const char* name : joints) {
      const double gap = (truth.row(find_joint(person.skeleton, name)) -
                          found.row(find_joint(fit.clip.skeleton, name)))
                             .norm();
      errors.joints += gap / static_cast<double>(12 * person.poses.size());
      errors.worst = std::max(errors.worst, gap);
    }
  }
  for (const char* name : {"left_knee", "left_ankle", "left_elbow", "left_wrist"}) {
    const double truth = person.skeleton.offsets.row(find_joint(person.skeleton, name)).norm();
    const double found = fit.clip.skeleton.offsets.row(find_joint(fit.clip.skeleton, name)).norm();
    errors.bones = std::max(errors.bones, std::abs(found / truth - 1));
  }
  return errors;
}

void print(const char* what, const MarkerFit& fit, const Errors& errors) {
  double rms = 0;
  for (const double r : fit.rms) {
    rms = std::max(rms, r);
  }
  std::printf("%s: joints %.1f mm mean, %.1f worst; bones %.1f%%; markers at most %.1f mm rms\n",
              what, 1e3 * errors.joints, 1e3 * errors.worst, 100 * errors.bones, 1e3 * rms);
}

TEST(MarkerNames, EverySpelling_GivesTheSamePlace) {
  for (const char* name : {"LKnee", "left_knee", "L.Knee", "knee_l", "Subject 1:LKnee", "LKJC"}) {
    const std::optional<MarkerPlace> place = marker_place(name);
    ASSERT_TRUE(place.has_value()) << name;
    EXPECT_EQ(place->joint, "left_knee") << name;
    EXPECT_TRUE(place->centre) << name;
  }
  EXPECT_EQ(marker_place("RANK")->joint, "right_ankle");
  EXPECT_EQ(marker_place("R.Ankle.Lat")->offset, marker_place("RANK")->offset);
  EXPECT_LT(marker_place("R.ASIS")->offset.x(), 0);
  EXPECT_GT(marker_place("LASI")->offset.x(), 0);
  EXPECT_EQ(marker_place("RBAK")->joint, "spine3");
}

TEST(MarkerNames, OtherNames_GiveNoPlace) {
  for (const char* name : {"", "*110", "Marker1", "Table", "L", "prop:corner", "RRKnee"}) {
    EXPECT_FALSE(marker_place(name).has_value()) << name;
  }
}

TEST(MarkerPose, PoseJacobian_MatchesFiniteDifferences) {
  const Skeleton skeleton = human_skeleton(human_anatomy({}));
  RidingMarkers markers;
  markers.joints = {0, 4, 15, 21};
  markers.offsets.resize(4, 3);
  markers.offsets << 0.1, 0, 0, 0.02, 0.03, 0.04, 0, 0.1, 0, 0, 0, 0;
  Random random{4};
  Pose pose = rest_pose(skeleton);
  for (Index i = 0; i < pose.rotations.size(); ++i) {
    pose.rotations.data()[i] = 0.5 * normal(random);
  }
  const Eigen::MatrixXd numeric = fixtures::finite_difference_jacobian(
      [&](const Eigen::VectorXd& x) {
        const Points at =
            marker_positions(markers, forward_kinematics(skeleton, pose_of_vector(x)));
        return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(at.data(), at.size()));
      },
      pose_vector(pose));
  const double error =
      fixtures::jacobian_error(marker_positions_jacobian(skeleton, pose, markers), numeric);
  EXPECT_LT(error, 1e-8);
}

TEST(MarkerPose, FittedPose_StaysWithinJointLimits) {
  const Skeleton skeleton = human_skeleton(human_anatomy({}));
  const int knee = find_joint(skeleton, "left_knee");
  Pose wrong = rest_pose(skeleton);
  wrong.rotations.row(knee) << -0.8, 0, 0;  // bent forward
  RidingMarkers markers;
  for (const char* name : {"pelvis", "left_hip", "right_hip", "left_knee", "left_ankle"}) {
    markers.joints.push_back(find_joint(skeleton, name));
  }
  markers.offsets = Points::Zero(5, 3);
  const Points targets = marker_positions(markers, forward_kinematics(skeleton, wrong));
  const std::vector<bool> seen(5, true);
  const MarkerPose found = fit_pose(skeleton, markers, targets, seen, rest_pose(skeleton));
  EXPECT_GE(found.pose.rotations(knee, 0), skeleton.limits_min(knee, 0));
  MarkerPoseOptions free;
  free.limits = false;
  const MarkerPose open = fit_pose(skeleton, markers, targets, seen, rest_pose(skeleton), free);
  EXPECT_LT(open.rms, 1e-3);
  EXPECT_LT(open.rms, found.rms);
}

TEST(MarkerPose, MismatchedSizes_AreRefused) {
  const Skeleton skeleton = human_skeleton(human_anatomy({}));
  RidingMarkers markers{{0}, Points::Zero(1, 3)};
  EXPECT_THROW(fit_pose(skeleton, markers, Points::Zero(2, 3), {true, true}, rest_pose(skeleton)),
               LogicError);
}

TEST(MarkerFit, JointCentreMarkers_RecoverTheMotion) {
  const MarkedPerson person = marked_person(joint_centre_names());
  const MarkerFit fit = fit_markers(person.clip);
  EXPECT_TRUE(fit.unknown.empty());
  const Errors errors = errors_of(fit, person);
  print("joint centres", fit, errors);
  EXPECT_LT(errors.joints, 0.005);
  EXPECT_LT(errors.bones, 0.01);
}

TEST(MarkerFit, PlugInGaitMarkers_RecoverTheMotion) {
  const MarkedPerson person = marked_person(plug_in_gait_names(), 0.01, 0.001);
  const MarkerFit fit = fit_markers(person.clip);
  EXPECT_TRUE(fit.unknown.empty());
  const Errors errors = errors_of(fit, person);
  print("Plug-in Gait, 10 mm astray, 1 mm noise", fit, errors);
  EXPECT_LT(errors.joints, 0.02);
}

TEST(MarkerFit, OpenSimMarkers_RecoverTheMotion) {
  const MarkedPerson person = marked_person(opensim_names(), 0.01, 0.001);
  const MarkerFit fit = fit_markers(person.clip);
  EXPECT_TRUE(fit.unknown.empty());
  const Errors errors = errors_of(fit, person);
  print("OpenSim, 10 mm astray, 1 mm noise", fit, errors);
  EXPECT_LT(errors.joints, 0.02);
}

TEST(MarkerFit, UnseenMarkersAndLostFrames_AreBridged) {
  MarkedPerson person = marked_person(joint_centre_names());
  for (std::size_t f = 5; f < 25; ++f) {
    person.clip.seen[f][f % 21] = false;
    person.clip.positions[f].row(static_cast<Index>(f % 21)).setZero();
  }
  person.clip.seen[27].assign(21, false);
  const MarkerFit fit = fit_markers(person.clip);
  EXPECT_LT(errors_of(fit, person).joints, 0.015);
  ASSERT_NE(finding(fit.clip, "motion-markers-unseen"), nullptr);
  EXPECT_EQ(fit.clip.motion.poses[27].rotations, fit.clip.motion.poses[26].rotations);
}

// As where a program writes a number of its own for what it did not see.
TEST(MarkerFit, MarkersBeyondReach_AreLeftOutByName) {
  const MarkedPerson person = marked_person(joint_centre_names());
  for (const double far : {10'000.0, 1e6, 4.0}) {
    MarkerClip clip = person.clip;
    for (std::size_t f = 0; f < clip.positions.size(); ++f) {
      clip.positions[f](2, 1) = far;  // RAnkle, in every frame
      if (f % 5 == 0) {
        clip.positions[f].row(0).setConstant(-far);  // RHip
        clip.positions[f].row(12).setConstant(far);  // Neck
      }
    }
    const MarkerFit fit = fit_markers(clip);
    EXPECT_LT(errors_of(fit, person).joints, 0.03) << far;
    EXPECT_EQ(finding(fit.clip, "motion-unit"), nullptr);
    const Finding* told = finding(fit.clip, "motion-markers-reach");
    ASSERT_NE(told, nullptr);
    EXPECT_THAT(told->what, AllOf(HasSubstr("RAnkle in 30 frames"), HasSubstr("RHip in 6 frames"),
                                  HasSubstr("Neck in 6 frames"), Not(HasSubstr("LHip"))));
    EXPECT_EQ(to_string(*reach_finding(clip)), to_string(*told));
  }
  EXPECT_FALSE(reach_finding(person.clip));
}

TEST(MarkerFit, MarkersBeyondReachInAWrongUnit_LeaveTheUnitRight) {
  MarkedPerson person = marked_person(joint_centre_names());
  for (Points& at : person.clip.positions) {
    at *= 1000;
    at(2, 1) = 1e7;
  }
  const MarkerFit fit = fit_markers(person.clip);
  EXPECT_LT(errors_of(fit, person).joints, 0.03);
  ASSERT_NE(finding(fit.clip, "motion-unit"), nullptr);
  EXPECT_THAT(finding(fit.clip, "motion-unit")->what, HasSubstr("multiplied by 0.001"));
}

TEST(MarkerFit, SwappedUnitsAndAxes_AreRepairedAndReported) {
  MarkedPerson person = marked_person(joint_centre_names());
  for (Points& at : person.clip.positions) {
    const Eigen::VectorXd y = at.col(1);  // z up, in millimetres that the header calls metres
    at.col(1) = -at.col(2);
    at.col(2) = y;
    at *= 1000;
  }
  const MarkerFit fit = fit_markers(person.clip);
  EXPECT_LT(errors_of(fit, person).joints, 0.005);
  ASSERT_NE(finding(fit.clip, "motion-unit"), nullptr);
  EXPECT_THAT(finding(fit.clip, "motion-unit")->what, HasSubstr("multiplied by 0.001"));
  ASSERT_NE(finding(fit.clip, "motion-up"), nullptr);
  MotionOptions said;
  said.up = 'z';
  said.metres_per_unit = 0.001;
  const MarkerFit asked = fit_markers(person.clip, said);
  EXPECT_EQ(finding(asked.clip, "motion-unit"), nullptr);
  EXPECT_LT(errors_of(asked, person).joints, 0.005);
}

TEST(MarkerFit, TrcFile_IsReadAsAMotion) {
  const std::filesystem::path path =
      std::filesystem::path(::testing::TempDir()) / "marker_fit_person.trc";
  const MarkedPerson person = marked_person(joint_centre_names(), 0, 0, 12);
  {
    std::FILE* file = std::fopen(path.c_str(), "w");
    const std::string text = fixtures::trc_text(person.clip, "mm", 1000);
    std::fwrite(text.data(), 1, text.size(), file);
    std::fclose(file);
  }
  const MotionClip clip = read_motion_file(path);
  EXPECT_EQ(clip.motion.poses.size(), 12u);
  EXPECT_TRUE(find_humanoid(clip.skeleton).has_value());
  EXPECT_EQ(finding(clip, "motion-unit"), nullptr);
  std::filesystem::remove(path);
}

// A motion of a skeleton, written as the markers that bear its joints' names.
MarkerClip joints_as_markers(const MarkedPerson& person, const std::vector<std::string>& names) {
  MotionClip clip;
  clip.name = "person";
  clip.skeleton = person.skeleton;
  clip.skeleton.names = names;
  clip.motion.fps = 60;
  for (std::size_t f = 0; f < person.poses.size(); ++f) {
    clip.motion.frame_ids.push_back(static_cast<int>(f));
  }
  clip.motion.poses = person.poses;
  return joint_markers(clip);
}

double worst_joint(const MarkerFit& fit, const MarkedPerson& person) {
  double worst = 0;
  for (std::size_t f = 0; f < person.poses.size(); ++f) {
    const Points truth = forward_kinematics(person.skeleton, person.poses[f]).positions;
    const Points found = forward_kinematics(fit.clip.skeleton, fit.clip.motion.poses[f]).positions;
    worst = std::max(worst, (truth.topRows(found.rows()) - found).rowwise().norm().maxCoeff());
  }
  return worst;
}

TEST(MarkerFit, JointsOfOurOwnBody_RecoverTheMotion) {
  const MarkedPerson person = marked_person(joint_centre_names());
  const MarkerFit fit = fit_markers(joints_as_markers(person, person.skeleton.names));
  EXPECT_EQ(fit.used.size(), 35u);  // of 55: all but the last two of each finger
  EXPECT_EQ(fit.unknown.size(), 20u);
  const double worst = worst_joint(fit, person);
  std::printf("own joints: worst of 22 %.1f mm\n", 1e3 * worst);
  EXPECT_LT(worst, 0.02);  // of the collars, whose bones share a factor with the shoulders
}

TEST(MarkerFit, JointsOfARiggedSkeleton_RecoverTheMotion) {
  const MarkedPerson person = marked_person(joint_centre_names());
  std::vector<std::string> names = person.skeleton.names;
  const std::pair<const char*, const char*> mixamo[] = {{"pelvis", "Hips"},
                                                        {"spine1", "Spine"},
                                                        {"spine2", "Spine1"},
                                                        {"spine3", "Spine2"},
                                                        {"neck", "Neck"},
                                                        {"head", "Head"},
                                                        {"left_hip", "LeftUpLeg"},
                                                        {"right_hip", "RightUpLeg"},
                                                        {"left_knee", "LeftLeg"},
                                                        {"right_knee", "RightLeg"},
                                                        {"left_ankle", "LeftFoot"},
                                                        {"right_ankle", "RightFoot"},
                                                        {"left_foot", "LeftToeBase"},
                                                        {"right_foot", "RightToeBase"},
                                                        {"left_collar", "LeftShoulder"},
                                                        {"right_collar", "RightShoulder"},
                                                        {"left_shoulder", "LeftArm"},
                                                        {"right_shoulder", "RightArm"},
                                                        {"left_elbow", "LeftForeArm"},
                                                        {"right_elbow", "RightForeArm"},
                                                        {"left_wrist", "LeftHand"},
                                                        {"right_wrist", "RightHand"}};
  for (const std::string prefix : {"", "mixamorig_", "mixamorig:"}) {
    for (std::size_t j = 0; j < names.size(); ++j) {
      names[j] = prefix + "bone" + std::to_string(j);
      for (const auto& [ours, theirs] : mixamo) {
        names[j] = person.skeleton.names[j] == ours ? prefix + theirs : names[j];
      }
    }
    const MarkerFit fit = fit_markers(joints_as_markers(person, names));
    EXPECT_EQ(fit.used.size(), 19u) << prefix;  // without the spine, whose joints differ by rig
    const double worst = worst_joint(fit, person);
    std::printf("%s: worst of 22 %.1f mm\n", prefix.c_str(), 1e3 * worst);
    EXPECT_LT(worst, 0.06);
  }
}

TEST(MarkerNames, HeadsOfKeypointsAndOfSkeletons_AreToldApart) {
  const auto head_of = [](std::vector<std::string> names) {
    names.emplace_back("Head");
    return marker_places(names).back()->offset.y();
  };
  EXPECT_GT(head_of(joint_centre_names()), 100) << "its top";
  std::vector<std::string> joints;
  for (const char* side : {"Left", "Right"}) {
    for (const char* joint : {"UpLeg", "Leg", "Foot", "Arm", "ForeArm", "Hand"}) {
      joints.push_back(std::string(side) + joint);
    }
  }
  EXPECT_EQ(head_of(joints), 0);
}

TEST(MarkerFit, RealTrial_PosesADefaultHuman) {
  for (const char* file :
       {"pose2sim_demo/single/pose-3d_reference/S00_P00_T01_BalancingTrial_0-100.trc",
        "pose2sim_demo/single/pose-3d_reference/S00_P00_T01_BalancingTrial_0-100_filt_butterworth."
        "trc"}) {
    ATELIER_TEST_FILE(path, file);
    const MarkerFit fit = fit_markers(read_trc(path));
    double squares = 0;
    for (const double rms : fit.rms) {
      squares += rms * rms / static_cast<double>(fit.rms.size());
    }
    const double rms = std::sqrt(squares);  // as the command says it
    std::printf("%s: %zu markers, %.1f mm rms\n", fit.clip.name.c_str(), fit.used.size(),
                1e3 * rms);
    EXPECT_EQ(fit.used.size(), 21u);
    EXPECT_LT(rms, 0.02);
    DefaultHumanOptions options = female_human();
    options.shape_basis = false;
    const BodyModel model = default_human(options);
    const Retargeted moved = retarget(fit.clip, model);
    ASSERT_EQ(moved.motion.poses.size(), 100u);
    const Points posed = skin_vertices(model, moved.motion.poses[50]);
    EXPECT_GT(posed.col(1).minCoeff(), -0.1);
    EXPECT_LT(posed.col(1).maxCoeff(), 2.2);
  }
}

TEST(MarkerHead, HeadPitch_IsMeasuredAndRemoved) {
  Points places(5, 3);
  places << 0.05, 0.1, 0.09, -0.05, 0.1, 0.09, 0.05, 0.1, -0.08, -0.05, 0.1, -0.08, 0, 0, 0;
  const std::vector<std::size_t> band = {0, 1, 2, 3};
  std::vector<Points> recorded;
  for (int i = 0; i < 5; ++i) {  // turns, and looks up by 0.4
    const Eigen::Matrix3d turn = rotation_matrix({0, 0.5 * i, 0}) * rotation_matrix({-0.4, 0, 0});
    recorded.push_back(places * turn.transpose());
  }
  std::vector<std::vector<bool>> seen(5, std::vector<bool>(5, true));
  seen[2] = {true, true, false, false, true};
  EXPECT_NEAR(head_pitch(places, band, recorded, seen), 0.4, 1e-9);
  const Points worn = levelled(places, band, 0.4);
  EXPECT_NEAR(head_pitch(worn, band, recorded, seen), 0, 1e-9);
  EXPECT_EQ(worn.row(4), places.row(4));
  EXPECT_EQ(head_pitch(places, {0, 1}, recorded, seen), 0);
  seen.pop_back();
  EXPECT_THROW(head_pitch(places, band, recorded, seen), LogicError);
}

TEST(MarkerFit, UnknownMarkers_AreRefused) {
  MarkedPerson person = marked_person(joint_centre_names(), 0, 0, 3);
  for (std::size_t m = 0; m < person.clip.markers.size(); ++m) {
    person.clip.markers[m] = "M" + std::to_string(100 + m);
  }
  EXPECT_THAT([&] { fit_markers(person.clip); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("0 of 21 that mean a place on a person"),
                                             HasSubstr("M100"), HasSubstr("Plug-in Gait"))));
}

TEST(MarkerFit, ArmMarkersAlone_AreRefused) {
  MarkedPerson person = marked_person(
      {"LShoulder", "LElbow", "LWrist", "RShoulder", "RElbow", "RWrist", "Neck", "Head"}, 0, 0, 3);
  EXPECT_THAT([&] { fit_markers(person.clip); },
              ThrowsMessage<DataError>(HasSubstr("of both legs")));
}

TEST(MarkerFit, CoincidentOrUnseenMarkers_AreRefused) {
  MarkedPerson person = marked_person(joint_centre_names(), 0, 0, 3);
  for (Points& at : person.clip.positions) {
    at.setZero();
  }
  EXPECT_THAT([&] { fit_markers(person.clip); }, ThrowsMessage<DataError>(HasSubstr("one place")));
  person = marked_person(joint_centre_names(), 0, 0, 3);
  for (std::vector<bool>& seen : person.clip.seen) {
    seen.assign(seen.size(), false);
  }
  EXPECT_THAT([&] { fit_markers(person.clip); },
              ThrowsMessage<DataError>(HasSubstr("a person's markers")));
}

TEST(MarkerFit, Options_AreDescribed) {
  MarkerFitOptions options;
  OptionTable table = describe(options);
  EXPECT_EQ(set_option(table, "noise", "0.02"), "");
  EXPECT_EQ(options.noise, 0.02);
  EXPECT_NE(set_option(table, "rounds", "0"), "");
}

}  // namespace
}  // namespace atelier
