#pragma once

#include <string>
#include <vector>

#include "capture/detection/decode.h"
#include "capture/detection/network.h"
#include "capture/detection/person_crop.h"
#include "core/image.h"

namespace atelier {

/// px, side of the landmark networks' input, whose values are 0 to 1.
inline constexpr int kLandmarkInput = 256;
inline constexpr int kLandmarks = 33;

/// Output of a landmark network for one crop.
struct PersonLandmarks {
  double presence = 0;    ///< probability that a person is in the crop, [0, 1]
  DetectedPoints points;  ///< [33,3] px of the image, beyond it too, and visibility, [0, 1]
  PersonCrop next;        ///< where the same person is looked for in the next frame
  PersonCrop crop;        ///< that was looked at
  ByteImage mask;         ///< [256,256] of `crop`: probability of the person, 0 to 255
};

/// Landmarks from a network's outputs: [195] (39 points of five values: px of the input, depth,
/// logits of visibility and presence; the last six steer the next crop), [1] presence, [39,64,64]
/// heatmaps and [1,256,256] logits of the mask. Each point moves to the mean of its heatmap's
/// probabilities in the 7 x 7 cells around it, where one of them is at least 0.5, as MediaPipe's
/// published graph refines them. Throws DataError (`file`) for outputs of other shapes.
PersonLandmarks decode_landmarks(const std::vector<NetworkOutput>& outputs, const PersonCrop& crop,
                                 const std::string& file = "");

}  // namespace atelier
