#pragma once

#include <Eigen/Core>
#include <string>

#include "bodymodel/euler.h"

namespace atelier::fixtures {

/// R = R_order[0](angles[0]) R_order[1](angles[1]) R_order[2](angles[2]), angles in radians;
/// `order` is three letters of X, Y, Z.
inline Eigen::Matrix3d euler_matrix(const std::string& order, const Eigen::Vector3d& angles) {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 3; ++i) {
    rotation = rotation * axis_rotation(order[static_cast<std::size_t>(i)] - 'X', angles[i]);
  }
  return rotation;
}

}  // namespace atelier::fixtures
