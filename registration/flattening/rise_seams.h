#pragma once

#include <vector>

#include "core/mesh.h"
#include "core/topology.h"

namespace atelier {

/// Where the two halves of trousers meet: from the crotch to the waist, in front and at the back,
/// near the middle. A flag for each edge of the topology of `mesh`. None where there are no legs,
/// or where they part more than 6 cm off the middle. Our choice.
///
/// @param facing  where the wearer looks, of length 1; LogicError otherwise
std::vector<char> rise_seams(const Mesh& mesh, const Topology& topology,
                             const Eigen::Vector3d& facing);

}  // namespace atelier
