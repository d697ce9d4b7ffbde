#pragma once

#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/human/human_template.h"

namespace atelier {

/// The 55 joints of an anatomy, named and ordered as SMPL-X has them (22 of the body, jaw, eyes,
/// 15 of each hand), with limits of motion from the A-pose. Sources of the limits: see the .cpp.
Skeleton human_skeleton(const HumanAnatomy& anatomy);

/// Skin weights of the whole template (middle, left, right): smooth steps across each joint's
/// plane, then averaged over the surface; at most 8 joints a vertex, mirror images left and right.
SkinWeights human_weights(const HumanTemplate& body);

/// Pose correctives that keep the volume of a bent limb: see the .cpp for the derivation. `rest`
/// are all vertices in rest pose.
std::vector<PoseCorrective> human_correctives(const Skeleton& skeleton, const SkinWeights& skin,
                                              const Points& rest);

}  // namespace atelier
