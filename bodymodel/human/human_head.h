#pragma once

#include "bodymodel/human/human_anatomy.h"

namespace atelier {

/// Sections of the skull with jaw, upright, metres: what the features of the face are set on.
/// `k` is a thousandth of stature.
HumanTube human_skull(double k);

/// Rough distance to the head at a point with x >= 0, given the distance to its skull: brow,
/// sockets, eyes with lids, nose with wings, lips with philtrum, chin, cheekbones, ears. Profile
/// and features are our choice, in the proportions that drawing manuals teach (eyes half way up the
/// head, five eyes across, nose base a third from brow to chin).
double head_features(double skull, Vec3d p, double k);

/// Where a point of the head of the middle build is in a woman's (0) to a man's (1): brow ridge and
/// forehead, opening of the eyes, nose, cheeks, lips, chin and angle of the jaw, the differences
/// that drawing manuals and forensic anatomy name; by how much is our choice, no more than 4 mm.
/// For x >= 0, in thousandths of stature; the point itself at 0.5.
Vec3d head_of_sex(Vec3d p, double male);

}  // namespace atelier
