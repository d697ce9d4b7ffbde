#pragma once

#include "core/types.h"

namespace atelier {

/// Number of pairs (edge, triangle) of which the edge passes through the triangle, the mesh with
/// itself: 0 for a cloth that nowhere passes through itself. On the CPU; signs that rounding could
/// change are computed again in long double, and what then lies exactly in a plane or on a line
/// counts as all edges shifted by one infinitely small step ("Simulation of simplicity",
/// Edelsbrunner and Mücke 1990, with a shift of one mesh in place of one of each vertex).
/// Primitives that share a vertex are not compared. Cost: O((F + found) log F).
int count_crossings(const Points& vertices, const Triangles& faces);

/// The same between two meshes (cloth and body), both ways.
int count_crossings(const Points& vertices, const Triangles& faces, const Points& other_vertices,
                    const Triangles& other_faces);

}  // namespace atelier
