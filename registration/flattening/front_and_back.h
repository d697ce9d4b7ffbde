#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

/// The horizontal unit direction that clothing faces, as far as its shape says. People are wider
/// than deep and their limbs are side by side: most of the area looks that way or back (normals
/// smoothed over `reach` metres) and least of it lies that way or back from the middle. It is the
/// first principal axis of the first (horizontal parts of normals, by area, trace 1) less the
/// second (horizontal places, the same). Front and back look alike, so it is the one of the two
/// that is nearer to +Z (then +X).
///
/// As nearly_ahead has it; +Z for what is about round, too, as wide skirts are: where the axes
/// differ by less than 0.15, of 2. Our choice. Throws LogicError unless reach is positive.
Eigen::Vector3d facing_of(const Mesh& mesh, double reach = 0.06);

/// +Z for a direction within 10 degrees of it, so that patterns of a person who faces it
/// approximately do not change. Any other direction is returned as it is.
Eigen::Vector3d nearly_ahead(const Eigen::Vector3d& facing);

/// A front and a back: the shortest cut along where the surface turns from facing one way to facing
/// the other, at the sides, under the arms and over the shoulders, as tailors begin. Returns a flag
/// for each edge of the mesh's topology.
///
/// Normals are smoothed over `reach` metres (implicit diffusion), so that folds do not count; then
/// each face is put in front or at the back by a minimum cut of what faces the other way (area
/// times the normal's part along `facing`) plus `reach` times the length of the cut (Boykov and
/// Kolmogorov 2004). Pieces of less than a thirtieth of the area join their neighbour. Our choice.
/// @param facing  where the front looks, of length 1
///
/// Throws LogicError unless reach is positive and facing of length 1.
std::vector<char> front_and_back(const Mesh& mesh, const Eigen::Vector3d& facing,
                                 double reach = 0.06);

}  // namespace atelier
