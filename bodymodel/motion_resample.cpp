#include "bodymodel/motion_resample.h"

#include <algorithm>
#include <cmath>

#include "bodymodel/rotation.h"
#include "core/error.h"

namespace atelier {

Eigen::Vector3d interpolated_rotation(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                      double share) {
  const Eigen::Matrix3d from = rotation_matrix(a);
  const Eigen::Vector3d turn = rotation_vector(from.transpose() * rotation_matrix(b));
  return rotation_vector(from * rotation_matrix(share * turn));
}

Pose interpolated_pose(const Pose& a, const Pose& b, double share) {
  ATELIER_CHECK(a.rotations.rows() == b.rotations.rows(), "poses of different skeletons");
  Pose pose;
  pose.root_translation = (1 - share) * a.root_translation + share * b.root_translation;
  pose.rotations.resize(a.rotations.rows(), 3);
  for (Index j = 0; j < a.rotations.rows(); ++j) {
    pose.rotations.row(j) = interpolated_rotation(a.rotations.row(j), b.rotations.row(j), share);
  }
  return pose;
}

Motion resampled(const Motion& motion, double fps) {
  ATELIER_CHECK(fps > 0 && motion.fps > 0, "frame rates are positive");
  if (fps == motion.fps || motion.poses.size() < 2) {
    Motion same = motion;
    same.fps = fps;
    return same;
  }
  Motion result;
  result.fps = fps;
  const double duration = static_cast<double>(motion.poses.size() - 1) / motion.fps;
  const int frames = static_cast<int>(std::floor(duration * fps + 1e-9)) + 1;
  for (int frame = 0; frame < frames; ++frame) {
    const double at = frame / fps * motion.fps;
    const std::size_t before =
        std::min(static_cast<std::size_t>(at + 1e-9), motion.poses.size() - 2);
    const double share = std::clamp(at - static_cast<double>(before), 0.0, 1.0);
    result.poses.push_back(
        share < 1e-9 ? motion.poses[before]
                     : interpolated_pose(motion.poses[before], motion.poses[before + 1], share));
    result.frame_ids.push_back(frame);
  }
  return result;
}

}  // namespace atelier
