#pragma once

#include <Eigen/Core>

#include "bodymodel/kinematics.h"
#include "bodymodel/rotation.h"

namespace atelier::fixtures {

/// Derivative of the joints' world positions by pose parameters, [3J, 3 + 3J], dense.
inline Eigen::MatrixXd joint_positions_jacobian(const Skeleton& skeleton, const Pose& pose) {
  const JointFrames frames = forward_kinematics(skeleton, pose);
  const std::vector<Eigen::Matrix3d> bases = joint_velocity_bases(skeleton, pose, frames);
  const auto count = static_cast<Index>(skeleton.names.size());
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3 * count, pose_parameter_count(skeleton));
  for (Index j = 0; j < count; ++j) {
    jacobian.block<3, 3>(3 * j, 0).setIdentity();
    for (int ancestor = skeleton.parents[static_cast<std::size_t>(j)]; ancestor >= 0;
         ancestor = skeleton.parents[static_cast<std::size_t>(ancestor)]) {
      const Eigen::Vector3d arm = frames.positions.row(j) - frames.positions.row(ancestor);
      jacobian.block<3, 3>(3 * j, 3 + 3 * ancestor) =
          -cross_matrix(arm) * bases[static_cast<std::size_t>(ancestor)];
    }
  }
  return jacobian;
}

}  // namespace atelier::fixtures
