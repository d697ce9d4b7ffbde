#pragma once

#include <array>
#include <vector>

#include "core/types.h"

namespace atelier {

/// Pairs of triangles of the plane that lie over each other (their insides share a point), the
/// smaller index first, in order. Decided exactly, by CGAL's predicates: two triangles lie beside
/// each other where the line of an edge of one parts them. Clockwise ones and those without area
/// are in no pair. `flat` is [V,2] finite; faces name its rows. O(F log F + pairs) where triangles
/// are even.
std::vector<std::array<int, 2>> overlapping_faces(const Points2& flat, const Triangles& faces);

/// True if a closed polygon crosses or touches itself, also where it goes back along the segment
/// before (a spike) or a point is there twice in a row; decided exactly. About O(n) where points
/// are evenly spaced.
bool crosses_itself(const Points2& loop);

/// True if a flat panel lies over itself: two of its triangles over each other, or an outline that
/// crosses or touches itself. Each would do where no triangle is turned over, so that one judges
/// the other.
bool lies_over_itself(const Points2& flat, const Triangles& faces);

/// How many triangles are clockwise or have no area, decided exactly.
int turned_faces(const Points2& flat, const Triangles& faces);

}  // namespace atelier
