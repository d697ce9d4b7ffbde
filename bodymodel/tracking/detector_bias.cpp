#include "bodymodel/tracking/detector_bias.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace atelier {
namespace {

/// Of a keypoint, over frames.
struct Offsets {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // m, in the joint's frame
  double squares = 0;                             // m2
  double count = 0;

  /// m2, of what is alike in all frames: the mean's square without the noise that is left in it.
  double standing() const {
    const double mean = sum.squaredNorm() / (count * count);
    const double noise = (squares / count - mean) / (count - 1);
    return std::max(0.0, mean - noise);
  }
};

/// [K] over all frames.
std::vector<Offsets> offsets_of(const FittedPerson& person, const std::vector<FrameTargets>& frames,
                                const std::vector<Eigen::VectorXd>& x) {
  const std::vector<int>& joints = person.places.riding.joints;
  RidingMarkers riding = person.places.riding;
  std::replace(riding.joints.begin(), riding.joints.end(), -1, 0);  // which are not asked for
  std::vector<Offsets> offsets(joints.size());
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const JointFrames posed =
        forward_kinematics(person.shaped.skeleton, pose_of_variables(person, x[f]));
    const Points at = marker_positions(riding, posed);
    for (Index k = 0; k < frames[f].keypoints.rows(); ++k) {
      const int joint = joints[static_cast<std::size_t>(k)];
      if (joint < 0 || !(frames[f].deviations[k] > 0)) {
        continue;
      }
      const Eigen::Vector3d off = (frames[f].keypoints.row(k) - at.row(k)).transpose();
      Offsets& one = offsets[static_cast<std::size_t>(k)];
      one.sum += posed.rotations[static_cast<std::size_t>(joint)].transpose() * off;
      one.squares += off.squaredNorm();
      one.count += 1;
    }
  }
  return offsets;
}

}  // namespace

Eigen::VectorXd detector_bias(const FittedPerson& person, const std::vector<FrameTargets>& frames,
                              const std::vector<Eigen::VectorXd>& x) {
  ATELIER_CHECK(frames.size() == x.size(), "a pose for each frame");
  const std::vector<Offsets> offsets = offsets_of(person, frames, x);
  const auto joints = static_cast<Index>(person.slots.size());
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(joints);  // m2
  Eigen::VectorXd keypoints = Eigen::VectorXd::Zero(joints);
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    if (offsets[k].count >= kBiasFrames) {
      const int joint = person.places.riding.joints[k];
      squares[joint] += offsets[k].standing();
      keypoints[joint] += 1;
    }
  }
  const double usual =
      keypoints.sum() > 0 ? squares.sum() / keypoints.sum() : kDetectorBias * kDetectorBias;
  Eigen::VectorXd errors(joints);
  for (Index j = 0; j < joints; ++j) {
    errors[j] = std::sqrt(keypoints[j] > 0 ? squares[j] / keypoints[j] : usual);
  }
  return errors;
}

}  // namespace atelier
