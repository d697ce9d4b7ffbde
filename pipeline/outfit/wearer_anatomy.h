#pragma once

#include "bodymodel/body_model.h"
#include "registration/template/body_anatomy.h"

namespace atelier {

/// Which lumps of flesh a body model's vertices belong to, and how they follow one another: each
/// vertex goes with the joint that moves it most, joints beside the limbs (fingers, twist bones)
/// with their parent. Throws DataError where the skeleton is no person's or a
/// limb has no vertex.
BodyAnatomy anatomy_of(const BodyModel& model);

}  // namespace atelier
