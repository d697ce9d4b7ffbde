#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

/// A triangular tube of 5 mm along a line of vertices, for pictures: closed, or open at both ends.
/// @param vertices  [V,3] m
Mesh ring_tube(const Points& vertices, const std::vector<int>& line, bool closed = true);

}  // namespace atelier
