#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

/// A front and a back: the shortest cut along where the surface turns from facing +Z to facing -Z,
/// at the sides, under the arms and over the shoulders, as tailors begin. Returns a flag for each
/// edge of the mesh's topology.
///
/// Normals are smoothed over `reach` metres (implicit diffusion), so that folds do not count; then
/// each face is put in front or at the back by a minimum cut of what faces the other way (area
/// times the normal's z) plus `reach` times the length of the cut (Boykov and Kolmogorov 2004).
/// Pieces of less than a thirtieth of the area join their neighbour. Our choice. Throws LogicError
/// unless reach is positive.
std::vector<char> front_and_back(const Mesh& mesh, double reach = 0.06);

}  // namespace atelier
