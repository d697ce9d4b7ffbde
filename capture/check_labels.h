#pragma once

#include <vector>

#include "capture/check_keypoints.h"
#include "capture/frame_reader.h"
#include "core/finding.h"

namespace atelier {

/// Masks and labels against the person that the keypoints show, over a few frames: masks that are
/// not where the joints are ("mask-inverted", "mask-disagrees": another camera's, another
/// frame's), and numbers of labels that are another taxonomy's ("label-taxonomy"): its face is not
/// where the nose is, or what it calls cloth has the colour of skin, as LIP's jumpsuits (10), which
/// are CIHP's torso, and the other way round. Nothing without keypoints that fit.
std::vector<Finding> check_labels(FrameReader& reader, const KeypointCheck& keypoints);

}  // namespace atelier
