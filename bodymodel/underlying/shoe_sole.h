#pragma once

#include "core/mesh.h"

namespace atelier {

/// Where a shoe stands: unit vectors.
struct ShoeAxes {
  Eigen::Vector3d down;   ///< from the ankle to the sole
  Eigen::Vector3d along;  ///< from the heel to the toes, at a right angle to it
};

/// The sole of a shoe of which cameras see the sides alone, as they do of a person who stands: from
/// side to side the lowest of the points at each place along the shoe, smoothed over 3 cm. A strip
/// of quads, split, that looks down; empty where the points are no shoe (fewer than 100, not 12 to
/// 45 cm long and 4 to 20 cm wide). Our choice.
/// @param points  [P,3] m, of one shoe as it was scanned
Mesh shoe_sole(const Points& points, const ShoeAxes& axes);

}  // namespace atelier
