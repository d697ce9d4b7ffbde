#pragma once

#include "core/topology.h"
#include "core/types.h"

namespace atelier {

/// Of each face the cosine between its normal and the mean normal of the faces that share a vertex
/// with it, itself left out; 0 where one of them has no area. [F]
Eigen::VectorXd cosines_around(const Topology& topology, const Points& x);

/// When a fold is too sharp, and how long to look for one that is not.
struct FairRidgesOptions {
  double least = 0.5;  ///< least cosine of a face with those around it, -1 to 1
  int rounds = 24;     ///< at most, 0 or more
};

/// The vertices of a surface without folds that are sharper than its triangles can carry: a fin or
/// a keel whose two sides lie closer than an edge, as where a surface was closed that nobody saw.
/// [V,3] m.
///
/// Around faces that face otherwise than those about them (`cosines_around` below `least`), two
/// rings wide and a ring wider every fourth round, vertices go halfway to where the sum of squares
/// of what each is off the mean of its neighbours is least: a thin plate, which keeps a saddle.
/// Going to that mean itself draws a saddle into a neck, whose edge is as sharp. Rims, faces at
/// them and all else stay where they are. Our choice, after Botsch and Kobbelt, "An intuitive
/// framework for real-time freeform modeling", 2004.
///
/// Throws LogicError for options out of their range and for vertices of another surface. A small
/// sparse factorisation a round.
Points faired_ridges(const Topology& topology, Points x, const FairRidgesOptions& options = {});

}  // namespace atelier
