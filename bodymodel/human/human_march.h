#pragma once

#include "bodymodel/human/human_field.h"
#include "bodymodel/human/human_half_mesh.h"

namespace atelier {

/// The left half of the field's zero set by marching tetrahedra on a grid of cells of `grid`
/// metres: closed but for the middle plane, with uneven triangles. Six tetrahedra a cell, split as
/// Kuhn does, so that neighbours agree.
HumanHalfMesh march_human(const HumanField& field, double grid);

}  // namespace atelier
