#pragma once

#include "core/types.h"

namespace atelier {

/// Triangles of a flat region.
struct FlatMesh {
  Points2 vertices;  ///< [V,2] metres; the outline's points come first, in its order
  Triangles faces;   ///< [F,3] counter-clockwise
};

/// Fills a simple counter-clockwise outline with isotropic triangles of about `edge_length` metres;
/// no point is added on the outline. Constrained Delaunay triangulation (CGAL) of the outline and a
/// triangular lattice, relaxed. Throws DataError if the outline is not simple or encloses nothing.
FlatMesh triangulate_outline(const Points2& outline, double edge_length);

}  // namespace atelier
