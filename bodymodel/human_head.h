#pragma once

#include "bodymodel/human_anatomy.h"

namespace atelier {

/// Sections of the skull with jaw, upright, metres: what the features of the face are set on.
/// `k` is a thousandth of stature.
HumanTube human_skull(double k);

/// Rough distance to the head at a point with x >= 0, given the distance to its skull: brow,
/// sockets, eyes with lids, nose with wings, lips with philtrum, chin, cheekbones, ears. Profile
/// and features are our choice, in the proportions that drawing manuals teach (eyes half way up the
/// head, five eyes across, nose base a third from brow to chin).
double head_features(double skull, Vec3d p, double k);

}  // namespace atelier
