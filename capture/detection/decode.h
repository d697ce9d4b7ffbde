#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "capture/detection/network.h"

namespace atelier {

/// Points in the network's input: [K,3] px (the first pixel's centre at (0.5, 0.5)) and confidence.
using DetectedPoints = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// One person from one heatmap a point: its maximum, moved between pixels by the parabola through
/// its neighbours (a common refinement; Zhang 2020 compares others). The confidence is the maximum,
/// cut to [0, 1].
/// @param heatmaps  [K,h,w]; of more than `points` maps the first are taken (OpenPose: then comes
///                  the background, then the limbs' fields)
/// Throws DataError (`file`) for another shape or fewer maps.
DetectedPoints decode_heatmaps(const NetworkOutput& heatmaps, int points, int input_width,
                               int input_height, const std::string& file = "");

/// One person from one row for x and one for y a point (SimCC; Li 2022, as RTMPose exports it): the
/// maxima; the confidence is the smaller of the two, cut to [0, 1].
/// @param x  [K, n] with n a multiple of the input's width @param y  the same of its height
DetectedPoints decode_simcc(const NetworkOutput& x, const NetworkOutput& y, int input_width,
                            int input_height, const std::string& file = "");

/// Everybody from OpenPose's 18 COCO points: maxima of each heatmap joined greedily along the part
/// affinity fields (Cao 2017). @param output  [57,h,w]: 18 points, background, 19 limbs x 2
std::vector<DetectedPoints> decode_openpose_people(const NetworkOutput& output, int input_width,
                                                   int input_height, double threshold = 0.1,
                                                   const std::string& file = "");

/// The class of each pixel: logits are brought to `width` x `height` between pixels, then the
/// largest wins. @param logits  [C,h,w], 2 to 250 classes
ByteImage decode_parsing(const NetworkOutput& logits, int width, int height,
                         const std::string& file = "");

}  // namespace atelier
