#pragma once

#include <vector>

#include "core/mesh.h"
#include "core/topology.h"

namespace atelier {

/// Where sleeves are set in: for each arm's opening that has one on the other side, a loop through
/// the armpit round the arm. A flag for each edge of the topology of `mesh`.
///
/// Arms are openings beside the middle in pairs, unless they are legs: no opening in the middle
/// lies as low, and there is one such pair and one waist. The armpit is the place of most negative
/// curvature about where the loops at one distance from the opening begin to grow as they do on a
/// trunk (by their distance or more). The loop is the shortest through it that parts the
/// opening from the others, near the upright plane halfway between across the arm and along the
/// trunk. None where the limb is shorter than 4 cm, or holds another opening or more than 0.35 of
/// the area, nor where that holds of the other arm. Our choice of all.
///
/// @param facing  where the wearer looks, of length 1; LogicError otherwise
std::vector<char> limb_rings(const Mesh& mesh, const Topology& topology,
                             const Eigen::Vector3d& facing);

}  // namespace atelier
