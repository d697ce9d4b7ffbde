#pragma once

#include "bodymodel/body_model.h"

namespace atelier {

/// The model with shape parameters behind its own for what its shapes may not say: the lengths of
/// a person's bones, both sides alike, in metres more than the model has at its neutral shape:
/// "thigh_length", "shin_length", "foot_length", "upper_arm_length", "forearm_length",
/// "shoulder_breadth_half", "hip_breadth_half", "trunk_length", "neck_length"; and for a model
/// without any shape "size", its share beyond the model's. A bone grows along itself: what hangs on
/// its end moves with it, its own skin in proportion to the place along it. Names that the model
/// has already get "bone_" before theirs.
/// @param spread  share of a bone's length by which it differs from what the shape says: half the
///                plausible range
/// Throws DataError for a body that is no person, LogicError unless spread is above 0. O(V).
BodyModel with_bone_lengths(const BodyModel& model, double spread = 0.02);

}  // namespace atelier
