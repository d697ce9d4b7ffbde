#pragma once

#include <vector>

#include "core/topology.h"

namespace atelier {

/// Cloth without a triangle turned over.
struct Unfolded {
  Points vertices;       ///< [V,3] m
  int given_back = 0;    ///< vertices that a shape took back
  int still_turned = 0;  ///< triangles; 0 wherever one of the shapes has none
};

/// Cloth at x with no triangle turned against those around it (inverted_faces): turned_back, where
/// that puts all of them right. Where it does not (a crease between two limbs that both pull),
/// cloth gives up where it was found: around each fold it takes a shape back, laid over it by the
/// best rigid motion, in full within half of a number of edges and less and less up to that number.
/// It doubles until the fold is gone, and at last is all of the cloth, so that of a shape that has
/// no turned triangle none ever comes out. Our choice.
/// @param x       [V,3] m
/// @param shapes  [V,3] m each, of the same cloth, tried in this order at every number of edges;
///                without any, turned_back is all that is done
/// Throws LogicError for shapes of another cloth, or where a coordinate is no number.
Unfolded unfolded(const Topology& topology, Points x, const std::vector<Points>& shapes);

}  // namespace atelier
