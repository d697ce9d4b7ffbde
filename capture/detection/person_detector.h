#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "capture/detection/network.h"
#include "capture/detection/person_crop.h"

namespace atelier {

/// px, side of the person detector's input, whose values are -1 to 1.
inline constexpr int kPersonInput = 224;

/// A person that the detector saw.
struct DetectedPerson {
  double score = 0;  ///< [0, 1]
  PersonCrop crop;   ///< px of the image
};

/// Centres of the detector's anchors in its input, each coordinate in [0, 1]: two for each cell of
/// 8 and 16 pixels, six for each of 32 (single-shot detection, Liu et al. 2016; their number and
/// strides are those of the published graph of MediaPipe's pose detection). [2254, 2]
const Eigen::Matrix<double, Eigen::Dynamic, 2>& person_anchors();

/// The people in the detector's outputs for a whole image: boxes [2254,12] (centre, size and four
/// points, px from the anchor) and scores [2254,1] (logits). Of boxes that overlap by more than 0.3
/// of their union the mean weighted by score remains. Best first.
/// @param threshold  least score, (0, 1)
/// Throws DataError (`file`) for outputs of other shapes.
std::vector<DetectedPerson> decode_people(const std::vector<NetworkOutput>& outputs,
                                          int image_width, int image_height, double threshold,
                                          const std::string& file = "");

}  // namespace atelier
