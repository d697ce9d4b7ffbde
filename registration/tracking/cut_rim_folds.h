#pragma once

#include "core/mesh.h"

namespace atelier {

/// A surface without the triangles that remeshing and smoothing leave folded over or thin at its
/// rim; nothing else moves. One after the other are cut off: a triangle with an edge on the
/// boundary that is turned against those around it (inverted_faces), folded over the one beside it
/// by more than 120 degrees, or at a vertex of an inner one that is turned; and one with two such
/// edges that is so, or not as high over the third as 5% of its length. None whose loss would leave
/// two fans of triangles at a vertex, or nothing of a piece. Vertices without triangles go; what
/// stays keeps its order, which part_of_mesh gives up. Our choice.
/// @param mesh  attributes of vertices and faces but their positions are dropped where one is cut
/// Throws LogicError as topology_of. Cost: faces x triangles cut.
Mesh cut_rim_folds(Mesh mesh);

}  // namespace atelier
