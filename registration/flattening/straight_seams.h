#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

/// The vertices of a surface, slid along it until its seams run straight instead of zigzag along
/// triangles. [V,3] m.
///
/// `cut` has one flag for each edge of the topology of `mesh.faces`. Rounds of curve shortening, of
/// which n smooth over about the root of n / 2 edges to either side: each vertex of a seam goes
/// halfway to the middle of its neighbours in the seam, each other one within four edges of a seam
/// halfway to the middle of its neighbours, then to the nearest point of the surface, which curves
/// between its vertices so that slides take little of its area. A move that
/// would turn a triangle by more than 60 degrees, or make it a sliver (less than a third as even as
/// an equilateral one, or with a corner below 10 degrees) or more of one, is not made. Rims, tips
/// of darts and what is farther stay where they are. Our choice, of Laplacian smoothing (Field,
/// "Laplacian smoothing and Delaunay triangulations", 1988).
///
/// Throws LogicError for another number of flags. A nearest point for each vertex near a seam and
/// round.
Points straightened_seams(const Mesh& mesh, const std::vector<char>& cut, int rounds = 30);

}  // namespace atelier
