#pragma once

#include "bodymodel/human/human_field.h"

namespace atelier {

/// How long the template's edges are to be at a point of the skin, metres: 18 mm on trunk and
/// limbs, less on hands, feet and face (docs/methods/default_human.md has the table). Our choice.
double human_edge_length(const HumanField& field, Vec3d p);

}  // namespace atelier
