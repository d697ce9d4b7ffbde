#pragma once

#include <vector>

#include "core/types.h"

namespace atelier {

/// One pose of a skeleton.
struct Pose {
  Eigen::Vector3d root_translation =
      Eigen::Vector3d::Zero();  ///< metres, added to the root's offset
  Points rotations;  ///< [J,3] rotation vectors (axis times angle, radians) relative to the parent
};

/// Poses over time.
struct Motion {
  double fps = 0;              ///< frames per second
  std::vector<int> frame_ids;  ///< [N], the capture's own numbers, increasing
  std::vector<Pose> poses;     ///< [N]
};

}  // namespace atelier
