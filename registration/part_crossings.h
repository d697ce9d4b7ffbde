#pragma once

#include "core/mesh.h"

namespace atelier {

/// The mesh with places that pass through each other smoothed until they part, and how many pairs
/// of triangles still do. Each round moves the corners of the triangles that meet, and their
/// neighbours, halfway to the mean of their neighbours (vertices of the rim along the rim). Where
/// nothing meets, nothing moves. Throws LogicError as self_intersections.
struct PartedMesh {
  Mesh mesh;
  int crossings = 0;
};
PartedMesh part_crossings(Mesh mesh, int rounds = 20);

}  // namespace atelier
