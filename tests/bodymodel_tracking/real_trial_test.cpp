// A real trial of a person, from keypoints in space alone.
#include <gtest/gtest.h>

#include "bodymodel/formats/makehuman.h"
#include "bodymodel/formats/motion_trc.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/measure.h"
#include "bodymodel/tracking/personalize.h"
#include "tests/bodymodel_tracking/posed_person.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

/// Pose2Sim's name of a keypoint as ours: "RBigToe" is "right_big_toe".
std::string our_name(const std::string& name) {
  const std::pair<const char*, const char*> parts[] = {
      {"Hip", "hip"},           {"Knee", "knee"},          {"Ankle", "ankle"},
      {"BigToe", "big_toe"},    {"SmallToe", "small_toe"}, {"Heel", "heel"},
      {"Shoulder", "shoulder"}, {"Elbow", "elbow"},        {"Wrist", "wrist"}};
  for (const auto& [theirs, ours] : parts) {
    for (const auto& [letter, side] : {std::pair("R", "right_"), std::pair("L", "left_")}) {
      if (name == std::string(letter) + theirs) {
        return std::string(side) + ours;
      }
    }
  }
  return name == "Nose" ? "nose" : name == "Neck" ? "neck" : name == "CHip" ? "mid_hip" : name;
}

constexpr const char* kTrial =
    "pose2sim_demo/single/pose-3d_reference/S00_P00_T01_BalancingTrial_0-100.trc";

/// Every so manieth frame.
TrackInput trial(const std::filesystem::path& path, std::size_t step = 1) {
  const MarkerClip clip = read_trc(path);
  TrackInput input;
  input.fps = clip.fps;
  for (const std::string& name : clip.markers) {
    input.keypoint_names.push_back(our_name(name));
  }
  for (std::size_t f = 0; f < clip.positions.size(); f += step) {
    TrackFrame frame;
    frame.keypoints = clip.positions[f];
    frame.deviations = Eigen::VectorXd::Zero(frame.keypoints.rows());
    for (Index k = 0; k < frame.keypoints.rows(); ++k) {
      frame.deviations[k] = clip.seen[f][static_cast<std::size_t>(k)] ? 0.01 : 0;
    }
    input.frame_ids.push_back(clip.frame_ids[f]);
    input.frames.push_back(std::move(frame));
  }
  return input;
}

/// Limbs as thick as the model's at its own stature, and a person's mass; keypoints alone say no
/// more.
void keeps_its_girths(const BodyModel& model, const TrackInput& few) {
  const Personalization found = personalize(model, few);
  for (const Finding& finding : found.findings) {
    EXPECT_NE(finding.code, "measure-implausible") << finding.what;
  }
  const auto measured = [](BodyModel person) {
    person.skeleton = with_smpl_names(person.skeleton, recognised_humanoid(person.skeleton));
    return measure_body(person);
  };
  const BodyMeasurements usual = measured(model);
  const BodyMeasurements ours = measured(found.person.model);
  std::printf("%s: calf %.3f m (usual %.3f), forearm %.3f m (%.3f), %.1f kg (%.1f)\n",
              model.name.c_str(), ours.calf_girth, usual.calf_girth, ours.forearm_girth,
              usual.forearm_girth, ours.mass, usual.mass);
  const double taller = ours.stature / usual.stature;
  EXPECT_NEAR(ours.calf_girth / (usual.calf_girth * std::sqrt(taller)), 1, 0.1);
  EXPECT_NEAR(ours.forearm_girth / (usual.forearm_girth * std::sqrt(taller)), 1, 0.1);
  EXPECT_NEAR(ours.mass / (usual.mass * taller * taller), 1, 0.15);
}

TEST(RealTrial, KeypointsAlone_KeepTheGirthsOfLimbs) {
  ATELIER_TEST_FILE(path, kTrial);
  keeps_its_girths(default_human(), trial(path, 10));
  keeps_its_girths(default_human(female_human()), trial(path, 10));
}

TEST(RealTrial, KeypointsAlone_KeepTheGirthsOfMakeHumansLimbs) {
  ATELIER_TEST_FILE(path, kTrial);
  ATELIER_TEST_FILE(root, "makehuman");
  MakeHumanFiles files;
  files.base = root / "base/base.obj";
  files.rig = root / "base/default.mhskel";
  files.weights = root / "base/default_weights.mhw";
  files.macros = root / "targets/macrodetails";
  for (const char* target :
       {"macrodetails/universal-female-young-averagemuscle-minweight",
        "macrodetails/universal-female-young-averagemuscle-maxweight",
        "measure/measure-calf-circ-decr", "measure/measure-upperleg-height-incr",
        "measure/measure-lowerleg-height-incr"}) {
    files.targets.push_back(root / "targets" / (std::string(target) + ".target"));
  }
  MakeHumanOptions woman;
  woman.macros.gender = 0;
  const BodyModel model = read_makehuman(files, woman).model;
  ASSERT_EQ(model.shape.size(), 5u);
  keeps_its_girths(model, trial(path, 10));
}

TEST(RealTrial, HundredFrames_AreTrackedFromKeypointsAlone) {
  ATELIER_TEST_FILE(path, kTrial);
  const TrackInput input = trial(path);
  ASSERT_EQ(input.frames.size(), 100u);
  for (const bool measured : {false, true}) {
    BodyModel model = plain_human();
    if (measured) {  // bone lengths from ten of the frames
      model = personalize(default_human(), trial(path, 10)).person.model;
    }
    const Tracking tracking = track(model, input);
    const FittedPerson person = fitted_person(model, input.keypoint_names);
    std::vector<double> errors;
    double jump = 0;
    double shaking = 0;
    double shaken = 0;
    int flips = 0;
    for (std::size_t f = 0; f < 100; ++f) {
      const Points& joints = tracking.tracked.joints[f];
      EXPECT_EQ(tracking.tracked.trusted[f], 1) << f;
      for (Index k = 0; k < input.frames[f].keypoints.rows(); ++k) {
        const int joint = person.places.riding.joints[static_cast<std::size_t>(k)];
        const bool centre = joint >= 0 && person.places.riding.offsets.row(k).norm() < 1e-9;
        if (centre && input.frames[f].deviations[k] > 0) {
          errors.push_back((joints.row(joint) - input.frames[f].keypoints.row(k)).norm());
        }
      }
      if (f > 1) {  // how unsteadily joints and their keypoints go on, as accelerations are
        for (Index k = 0; k < input.frames[f].keypoints.rows(); ++k) {
          const int joint = person.places.riding.joints[static_cast<std::size_t>(k)];
          if (joint < 0 || person.places.riding.offsets.row(k).norm() > 1e-9) {
            continue;
          }
          const auto& of = tracking.tracked.joints;
          shaking +=
              (of[f].row(joint) - 2 * of[f - 1].row(joint) + of[f - 2].row(joint)).squaredNorm();
          shaken += (input.frames[f].keypoints.row(k) - 2 * input.frames[f - 1].keypoints.row(k) +
                     input.frames[f - 2].keypoints.row(k))
                        .squaredNorm();
        }
      }
      if (f > 0) {
        for (const int joint : person.joints) {
          jump = std::max(jump,
                          (joints.row(joint) - tracking.tracked.joints[f - 1].row(joint)).norm());
        }
      }
      const Eigen::RowVector3d hips = joints.row(find_joint(model.skeleton, "left_hip")) -
                                      joints.row(find_joint(model.skeleton, "right_hip"));
      const Eigen::RowVector3d before =
          tracking.tracked.joints[f > 0 ? f - 1 : 0].row(find_joint(model.skeleton, "left_hip")) -
          tracking.tracked.joints[f > 0 ? f - 1 : 0].row(find_joint(model.skeleton, "right_hip"));
      flips += hips.dot(before) < 0 ? 1 : 0;
    }
    std::nth_element(errors.begin(), errors.begin() + std::ssize(errors) / 2, errors.end());
    const double median = errors[errors.size() / 2];
    std::printf("%s body: median %.1f mm over %zu joints, largest step %.1f mm a frame, %d flips\n",
                measured ? "measured" : "default", 1e3 * median, errors.size(), 1e3 * jump, flips);
    const double stated = tracking.tracked.deviations.mean();
    std::printf("deviation that it states: %.1f mm in the mean\n", 1e3 * stated);
    EXPECT_LT(median, 0.035);
    EXPECT_GT(stated, 0.5 * median);
    EXPECT_LT(stated, 1.5 * median);
    // Keypoints of a hip jump by 121 mm in one frame; who has the person's bones follows them more.
    EXPECT_LT(jump, measured ? 0.09 : 0.06);
    EXPECT_EQ(flips, 0);
    std::printf("second differences: %.2f of those of the keypoints\n",
                std::sqrt(shaking / shaken));
    EXPECT_LT(std::sqrt(shaking / shaken), 0.2);  // smooth: noise is not followed
  }
}

}  // namespace
}  // namespace atelier::fixtures
