#pragma once

#include <vector>

#include "core/types.h"

namespace atelier {

/// For each closed outline the others that may be its mirror image, the likeliest first: at most
/// six, of less than 1.3 times its area and it of theirs, in order of the distance between four
/// lengths that neither a motion nor a mirror changes: the root of the area, a quarter of the
/// perimeter, and the two principal radii of gyration of the line (roots of its second moments).
/// Places in `outlines`. O(N^2) in these lengths alone: a second for 10,000 outlines. Our choice.
///
/// @param outlines  [N,2] m each, of three points or more; LogicError otherwise
std::vector<std::vector<std::size_t>> alike_outlines(const std::vector<Points2>& outlines);

}  // namespace atelier
