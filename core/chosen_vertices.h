#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

/// A mesh's vertices `rows`, in that order, with every attribute that vertices have; no faces and
/// no texture. Rows must be in range.
Mesh chosen_vertices(const Mesh& mesh, const std::vector<int>& rows);

}  // namespace atelier
