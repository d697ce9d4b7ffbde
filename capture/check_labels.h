#pragma once

#include <string>
#include <vector>

#include "capture/check_keypoints.h"
#include "capture/frame_reader.h"
#include "core/finding.h"

namespace atelier {

/// Checks labels, masks and keypoints against each other.
struct LabelCheck {
  std::vector<Finding> findings;
  std::vector<std::string> sound_masks;  ///< cameras whose masks are surely where the person is
};

/// Masks against the labels of the same images and, as labels too, against the person that the
/// keypoints show, over a few frames: masks whose background is set ("mask-inverted"), that are
/// turned ("mask-turned"), or not where the joints are for another reason ("mask-disagrees":
/// another camera's, another frame's), and numbers of labels that are another taxonomy's
/// ("label-taxonomy"): its face is not where the nose is, or what it calls cloth has the colour of
/// skin, as LIP's jumpsuits (10), which are CIHP's torso, and the other way round. Of cameras in
/// which the keypoints show an error, and without keypoints that fit, labels alone are asked.
LabelCheck check_labels(FrameReader& reader, const KeypointCheck& keypoints);

}  // namespace atelier
