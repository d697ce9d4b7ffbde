#pragma once

#include "core/mesh.h"

namespace atelier {

/// A garment's surface without the bridges that glue it to itself.
struct CutBridges {
  Mesh mesh;      ///< open where bridges were
  int count = 0;  ///< bridges cut
};

/// Cuts bridges between parts that only came near to each other, as a sleeve and the trunk: a
/// garment is a sphere with openings, so that each handle of the surface is one. A bridge is the
/// handle of a shortest loop whose disc lies inside (behind the surface); the other loop of a
/// handle, through its eye, as round the armpit, has its disc outside and is a wrong place to cut.
/// Loops are those of trees of shortest ways and of faces (Erickson and Whittlesey, "Greedy optimal
/// homotopy and homology generators", 2005), from some two hundred places; those longer than
/// `longest` metres stay. The faces at the loop are taken out, and both rims are left as holes.
///
/// The mesh has to be an oriented manifold of one piece. Surfaces without handles are returned as
/// they are. Our choice. About 200 V log V for each bridge, for even meshes of some thousand
/// vertices.
CutBridges cut_bridges(const Mesh& mesh, double longest = 0.6);

}  // namespace atelier
