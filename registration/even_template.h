#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

/// A clean mesh of a surface: nearly equal triangles with edges of `edge_length` metres, closed
/// over the loops of boundary vertices in `holes` (triangulated, refined and faired: Liepa,
/// "Filling holes in meshes", 2003), open at all others. Isotropic remeshing (Botsch and Kobbelt,
/// "A remeshing approach to multiresolution modeling", 2004) by CGAL.
///
/// Throws DataError where the surface is no orientable manifold, LogicError for an edge length that
/// is not positive.
Mesh even_mesh(const Mesh& surface, const std::vector<std::vector<int>>& holes, double edge_length);

}  // namespace atelier
