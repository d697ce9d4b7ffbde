#pragma once

#include "bodymodel/body_model.h"
#include "bodymodel/underlying/clothed_scan.h"

namespace atelier {

/// Adds to a labelled scan the soles of its shoes (bodymodel/underlying/shoe_sole.h), which no
/// camera sees of a person who stands, as hair and shoes. Each shoe is what is labelled as shoe
/// nearest to a foot, which says where down is: in rest pose it stands on the floor. Nothing for
/// bodies whose legs nobody can tell.
/// @param body  [V,3] m, the person in the frame's pose
void add_soles(ClothedScan& scan, const BodyModel& person, const Points& body);

}  // namespace atelier
