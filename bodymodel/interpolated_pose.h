#pragma once

#include "core/pose.h"

namespace atelier {

/// The rotation `share` of the way from a to b (rotation vectors), the short way round.
Eigen::Vector3d interpolated_rotation(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                      double share);

/// The pose `share` of the way from a to b. Throws LogicError for different numbers of joints.
Pose interpolated_pose(const Pose& a, const Pose& b, double share);

}  // namespace atelier
