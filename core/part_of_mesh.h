#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

/// The mesh of some of its faces with everything that their vertices have, without vertices and
/// texture coordinates that these faces do not use. `faces`: rows of `mesh.faces`, in the order in
/// which the part is to have them; vertices come in the order in which these first name them. A row
/// that is not there is a LogicError. Cost: O(V + faces).
Mesh part_of_mesh(const Mesh& mesh, const std::vector<Index>& faces);

}  // namespace atelier
