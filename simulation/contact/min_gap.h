#pragma once

#include <vector>

#include "core/types.h"

namespace atelier {

/// Which pairs of a cloth may be nearer than others: what was near each other at rest.
struct RestPlaces {
  const Points* positions = nullptr;        ///< [V,3] metres
  const std::vector<int>* layer = nullptr;  ///< [V], empty: one; layers have no rest in common
};

/// Least distance of a cloth to itself, of the pairs (vertex, triangle) and (edge, edge) that share
/// no vertex, as a share of what contact keeps there: `thickness` [m], but never more than 0.9 of
/// how far apart a pair of one layer was at rest. 1: it is kept everywhere. A distance has no sign:
/// where cloth is through cloth but no edge is near another, count_crossings alone knows. On the
/// CPU, in double. Throws LogicError unless thickness is above 0. Cost: O((F + found) log F).
double min_gap(const Points& vertices, const Triangles& faces, double thickness,
               const RestPlaces& rest);

/// The same between two meshes (cloth and body), of `thickness` alone.
double min_gap(const Points& vertices, const Triangles& faces, const Points& other_vertices,
               const Triangles& other_faces, double thickness);

}  // namespace atelier
