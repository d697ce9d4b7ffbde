#pragma once

#include "core/pose.h"

namespace atelier {

/// The rotation `share` of the way from a to b (rotation vectors), the short way round.
Eigen::Vector3d interpolated_rotation(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                      double share);

/// The pose `share` of the way from a to b. Throws LogicError for different numbers of joints.
Pose interpolated_pose(const Pose& a, const Pose& b, double share);

/// The motion at another rate: same start, same duration, frame ids from 0. Rotations take the
/// short way between frames; nothing is smoothed. Throws LogicError unless both rates are positive.
Motion resampled(const Motion& motion, double fps);

}  // namespace atelier
