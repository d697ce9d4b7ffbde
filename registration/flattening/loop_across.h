#pragma once

#include <vector>

#include "registration/edge_paths.h"

namespace atelier {

/// The shortest closed way through `base` that crosses the arc `arc` once, by `costs`: the edges of
/// it, none where there is no such way. Private to registration.
///
/// Dijkstra's algorithm over vertices and how often the way here has crossed the arc, -1 to 1
/// times. Faces left and right of the arc are told apart by the direction of its edges in them.
///
/// @param arc    vertices of a way along edges from rim to rim, `base` among them
/// @param costs  [E] m or so; infinite where no way leads
std::vector<int> loop_across(const Topology& topology, const EdgeGraph& graph,
                             const std::vector<int>& arc, int base,
                             const std::vector<double>& costs);

}  // namespace atelier
