// A real trial of a person, from keypoints in space alone.
#include <gtest/gtest.h>

#include "bodymodel/default_human.h"
#include "bodymodel/motion_trc.h"
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

TEST(RealTrial, AHundredFramesAreFollowedByKeypointsAlone) {
  ATELIER_TEST_FILE(path,
                    "pose2sim_demo/single/pose-3d_reference/S00_P00_T01_BalancingTrial_0-100.trc");
  const MarkerClip clip = read_trc(path);
  TrackInput input;
  input.fps = clip.fps;
  for (const std::string& name : clip.markers) {
    input.keypoint_names.push_back(our_name(name));
  }
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    TrackFrame frame;
    frame.keypoints = clip.positions[f];
    frame.deviations = Eigen::VectorXd::Zero(frame.keypoints.rows());
    for (Index k = 0; k < frame.keypoints.rows(); ++k) {
      frame.deviations[k] = clip.seen[f][static_cast<std::size_t>(k)] ? 0.01 : 0;
    }
    input.frame_ids.push_back(clip.frame_ids[f]);
    input.frames.push_back(std::move(frame));
  }
  ASSERT_EQ(input.frames.size(), 100u);
  for (const bool measured : {false, true}) {
    BodyModel model = plain_human();
    if (measured) {  // bone lengths from ten of the frames
      TrackInput few = input;
      few.frames.clear();
      few.frame_ids.clear();
      for (std::size_t f = 0; f < 100; f += 10) {
        few.frames.push_back(input.frames[f]);
        few.frame_ids.push_back(input.frame_ids[f]);
      }
      model = personalize(default_human(), few).person.model;
    }
    const Tracking tracking = track(model, input);
    const FittedPerson person = fitted_person(model, input.keypoint_names);
    std::vector<double> errors;
    double jump = 0;
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
    EXPECT_LT(median, 0.035);
    // Keypoints of a hip jump by 121 mm in one frame; who has the person's bones follows them more.
    EXPECT_LT(jump, measured ? 0.09 : 0.06);
    EXPECT_EQ(flips, 0);
  }
}

}  // namespace
}  // namespace atelier::fixtures
