#pragma once

#include "core/types.h"

namespace atelier {

/// Number of pairs (edge, triangle) of which the edge passes through the triangle, the mesh with
/// itself: 0 for a cloth that nowhere passes through itself. Exact test on the CPU; primitives that
/// share a vertex are not compared. Cost: O((F + found) log F).
int count_crossings(const Points& vertices, const Triangles& faces);

/// The same between two meshes (cloth and body), both ways.
int count_crossings(const Points& vertices, const Triangles& faces, const Points& other_vertices,
                    const Triangles& other_faces);

}  // namespace atelier
