#pragma once

#include <array>
#include <vector>

#include "core/vec.h"

namespace atelier {

/// The half of a symmetric surface at x >= 0 while it is being made: vertices of the middle plane
/// have x = 0.
struct HumanHalfMesh {
  std::vector<Vec3d> points;              ///< metres
  std::vector<std::array<int, 3>> faces;  ///< counter-clockwise from outside
};

}  // namespace atelier
