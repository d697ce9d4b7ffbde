#pragma once

#include <vector>

#include "core/types.h"

namespace atelier {

/// The outline `distance` metres outside of a simple counter-clockwise one: seam allowance. Corners
/// are mitred up to twice the distance and bevelled beyond; where the offset crosses itself (narrow
/// notches, darts) only its outermost line is kept. Our choice. Throws LogicError unless the
/// outline has three points or more and the distance is finite and not negative. O(n^2).
Points2 offset_outline(const Points2& outline, double distance);

/// The same with a distance for each segment, the one from point i to point i + 1.
Points2 offset_outline(const Points2& outline, const std::vector<double>& distances);

}  // namespace atelier
