#pragma once

#include <vector>

#include "core/topology.h"
#include "core/types.h"

namespace atelier {

/// The cut, and as many shortest further cuts as make every panel a disk, which can be laid flat:
/// from boundary to boundary along the shortest paths (by `costs`, one for each edge), the greedy
/// system of arcs of Erickson and Whittlesey ("Greedy optimal homotopy and homology generators",
/// 2005) with each panel's boundaries as the root; a closed sphere is slit between two far points.
/// Panels that are disks stay as they are. Throws LogicError unless there is one flag and one cost,
/// not negative, for each edge. O(F log F).
std::vector<char> cut_to_disks(const Topology& topology, const std::vector<char>& cut,
                               const std::vector<double>& costs);

}  // namespace atelier
