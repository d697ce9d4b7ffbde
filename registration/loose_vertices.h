#pragma once

#include "core/mesh.h"

namespace atelier {

/// The mesh without vertices that no face uses; the others keep their order, and with it the edges
/// theirs (`topology_of`), which `part_of_mesh` would change. Takes a mesh as `check_mesh` has it.
Mesh without_loose_vertices(const Mesh& mesh);

}  // namespace atelier
