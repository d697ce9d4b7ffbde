#pragma once

#include "bodymodel/human/human_field.h"
#include "bodymodel/human/human_half_mesh.h"

namespace atelier {

/// The half surface with isotropic triangles: `rounds` times edges longer than 4/3 of their length
/// are split, those shorter than 4/5 collapsed, valences evened out by flips, and vertices moved to
/// the mean of their triangles and back onto the field's zero set (Botsch and Kobbelt, A Remeshing
/// Approach to Multiresolution Modeling, SGP 2004). The border stays in the middle plane.
/// @param edge_scale  times human_edge_length
HumanHalfMesh remesh_human(const HumanField& field, HumanHalfMesh mesh, double edge_scale,
                           int rounds);

}  // namespace atelier
