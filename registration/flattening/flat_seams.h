#pragma once

#include <vector>

#include "core/topology.h"
#include "registration/flattening/flat_pattern.h"

namespace atelier {

/// The seams of a cut: runs of cut edges from one place where seams meet, end or reach the
/// garment's boundary to the next, in order of their first edge; closed runs start at their
/// smallest vertex. `cut` must have been made from `flags`. Private to registration.
std::vector<FlatSeam> flat_seams(const Topology& topology, const std::vector<char>& flags,
                                 const SurfaceCut& cut);

}  // namespace atelier
