#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

struct RemeshingOptions {
  double edge_length = 0.01;            ///< m, > 0
  std::vector<std::vector<int>> holes;  ///< loops of boundary vertices to be closed over
  int rounds = 5;                       ///< of splitting, collapsing, flipping and relaxing
  int relaxations = 3;                  ///< in a round
  bool rims_relax = true;               ///< boundaries become even too, and a round one is drawn in
};

/// A clean mesh of a surface: nearly equal triangles, closed over `holes` (triangulated, refined
/// and faired: Liepa, "Filling holes in meshes", 2003), open at all other loops. Isotropic
/// remeshing (Botsch and Kobbelt, "A remeshing approach to multiresolution modeling", 2004) by
/// CGAL. Attributes are dropped. Where faces touch in one vertex it is doubled.
///
/// Throws DataError where the surface is no orientable manifold, LogicError for an edge length that
/// is not positive.
Mesh isotropic_remeshing(const Mesh& surface, const RemeshingOptions& options);

}  // namespace atelier
