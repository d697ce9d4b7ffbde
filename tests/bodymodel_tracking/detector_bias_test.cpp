// By what keypoints are off in all frames alike.
#include "bodymodel/tracking/detector_bias.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/bodymodel_tracking/posed_person.h"

namespace atelier::fixtures {
namespace {

struct Seen {
  std::vector<FrameTargets> frames;
  std::vector<Eigen::VectorXd> x;
};

/// Someone who walks and turns, each keypoint of the left knee off by `beside`, seen from the knee.
Seen walk(int frames, double noise, const Eigen::Vector3d& beside) {
  Random random{5};
  Seen seen;
  const auto knee = std::find(body_25_names().begin(), body_25_names().end(), "left_knee") -
                    body_25_names().begin();
  const int joint = fitted_human().places.riding.joints[static_cast<std::size_t>(knee)];
  for (int f = 0; f < frames; ++f) {
    seen.x.push_back(walking(fitted_human(), 0.3 * f));
    seen.frames.push_back(keypoints_of(fitted_human(), seen.x.back(), noise, random));
    const JointFrames posed = forward_kinematics(fitted_human().shaped.skeleton,
                                                 pose_of_variables(fitted_human(), seen.x.back()));
    seen.frames.back().keypoints.row(knee) +=
        (posed.rotations[static_cast<std::size_t>(joint)] * beside).transpose();
  }
  return seen;
}

double at(const Eigen::VectorXd& errors, const char* name) {
  return errors[find_joint(fitted_human().shaped.skeleton, name)];
}

TEST(DetectorBias, ConstantKeypointOffset_IsTheDetectorBias) {
  const Seen seen = walk(8, 0, {0.02, 0, 0.015});
  const Eigen::VectorXd errors = detector_bias(fitted_human(), seen.frames, seen.x);
  ASSERT_EQ(errors.size(), static_cast<Index>(fitted_human().slots.size()));
  EXPECT_NEAR(at(errors, "left_knee"), 0.025, 1e-9);
  EXPECT_NEAR(at(errors, "right_knee"), 0, 1e-9);
  EXPECT_GT(at(errors, "spine2"), 1e-3) << "without a keypoint of its own: as the others";
  EXPECT_LT(at(errors, "spine2"), 0.025);
}

TEST(DetectorBias, Noise_GivesNoDetectorBias) {
  const Seen seen = walk(40, 0.01, Eigen::Vector3d::Zero());
  EXPECT_LT(detector_bias(fitted_human(), seen.frames, seen.x).maxCoeff(), 0.005);
}

TEST(DetectorBias, FewerThanThreeFrames_GiveTheDefaultBias) {
  for (const int frames : {0, 1, 2}) {
    const Seen seen = walk(frames, 0, Eigen::Vector3d::Zero());
    const Eigen::VectorXd errors = detector_bias(fitted_human(), seen.frames, seen.x);
    EXPECT_EQ(errors.minCoeff(), kDetectorBias);
    EXPECT_EQ(errors.maxCoeff(), kDetectorBias);
  }
  Seen seen = walk(3, 0, Eigen::Vector3d::Zero());
  EXPECT_LT(detector_bias(fitted_human(), seen.frames, seen.x).maxCoeff(), 1e-9);
  seen.frames[1].deviations.setZero();  // seen in two of them
  EXPECT_EQ(detector_bias(fitted_human(), seen.frames, seen.x).minCoeff(), kDetectorBias);
  seen.x.pop_back();
  EXPECT_THROW(detector_bias(fitted_human(), seen.frames, seen.x), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
