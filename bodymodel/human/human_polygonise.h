#pragma once

#include "bodymodel/human/human_field.h"
#include "core/mesh.h"

namespace atelier {

struct HumanPolygoniseOptions {
  double grid = 0.003;    ///< cell of the marching grid, metres, 0.002 to 0.02; toes are 3 mm apart
  int rounds = 18;        ///< rounds of splitting, collapsing, flipping and relaxing
  double edge_scale = 1;  ///< target edge lengths times this: 1 gives about 10k vertices
};

/// The left half (x >= 0) of the zero set as isotropic triangles, open along x = 0: marching
/// tetrahedra on a narrow band, then isotropic remeshing (Botsch and Kobbelt 2004) with edge
/// lengths after the part of the body, projected back onto the field.
Mesh polygonise_human(const HumanField& field, const HumanPolygoniseOptions& options = {});

}  // namespace atelier
