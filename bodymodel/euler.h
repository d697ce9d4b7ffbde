#pragma once

#include <Eigen/Core>
#include <string>

namespace atelier {

/// Rotation by `angle` (radians) about x, y or z (axis 0, 1, 2).
Eigen::Matrix3d axis_rotation(int axis, double angle);

/// Angles (radians) of R = R_order[0](angles[0]) R_order[1](angles[1]) R_order[2](angles[2]);
/// `order` is the letters X, Y, Z in some order, else LogicError. At the pole (middle angle of 90
/// degrees) the last angle is 0.
Eigen::Vector3d euler_angles(const std::string& order, const Eigen::Matrix3d& rotation);

/// Of the two sets of angles and their whole turns, the one nearest to `near`: keeps curves
/// continuous.
Eigen::Vector3d euler_angles(const std::string& order, const Eigen::Matrix3d& rotation,
                             const Eigen::Vector3d& near);

}  // namespace atelier
