#pragma once

#include <vector>

#include "core/topology.h"

namespace atelier {

/// The value of each vertex, averaged with those of the vertices that share an edge with it,
/// `rounds` times. [V], throws LogicError for another number of values. O(E) a round.
std::vector<double> neighbor_means(const Topology& topology, std::vector<double> values,
                                   int rounds);

}  // namespace atelier
