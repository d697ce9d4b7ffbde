#pragma once

#include "core/types.h"

namespace atelier {

/// Least distance [m] between a mesh and itself, of the pairs (vertex, triangle) and (edge, edge)
/// that share no vertex, looked for up to `reach` metres; `reach` where nothing is nearer. 0 where
/// it passes through itself only if an edge meets an edge there: count_crossings counts that.
/// Neighbours over an edge are among the pairs: a reach below the edges' lengths leaves flat ones
/// out. On the CPU, in double. Cost: O((F + found) log F).
double least_gap(const Points& vertices, const Triangles& faces, double reach);

/// The same between two meshes (cloth and body).
double least_gap(const Points& vertices, const Triangles& faces, const Points& other_vertices,
                 const Triangles& other_faces, double reach);

}  // namespace atelier
