#pragma once

#include <vector>

#include "core/topology.h"

namespace atelier {

/// [V] 1 where the surface ends: vertices of edges with one face.
std::vector<char> rim_vertices(const Topology& topology);

}  // namespace atelier
