#pragma once

#include <array>
#include <vector>

#include "core/types.h"

namespace atelier {

/// Whether triangles meet, decided exactly: coordinates are rounded to a grid of 2^-30 m (a
/// nanometre), on which every sign below is an integer computation without overflow. Touching
/// counts as meeting.

/// Pairs of faces of a mesh that meet elsewhere than in the vertices and edges they share, the
/// smaller index first, in order. Faces without area on the grid are left out. Throws LogicError
/// where a face names a missing vertex, or a coordinate is not finite or beyond 256 m. O(F log F +
/// pairs).
std::vector<std::array<int, 2>> self_intersections(const Points& vertices, const Triangles& faces);

}  // namespace atelier
