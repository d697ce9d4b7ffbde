#pragma once

#include <vector>

#include "core/topology.h"

namespace atelier {

/// 2 pi less the angles of the faces around each vertex, rad, [V]: the integral of the Gaussian
/// curvature about it. What is not 0 cannot be laid flat: positive on domes, negative on saddles. 0
/// where an edge has one face, or more than two. A vertex without faces has 2 pi. O(F).
///
/// @param vertices  [V,3] m, of `topology`; LogicError for another number
std::vector<double> angle_defects(const Points& vertices, const Topology& topology);

}  // namespace atelier
