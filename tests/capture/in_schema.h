#pragma once

#include <algorithm>
#include <string>

#include "capture/keypoint_schema.h"

namespace atelier::fixtures {

/// A person's points in another order, by name; what the source does not have is 0, 0, 0. Middle
/// points that the source lacks ("neck", "mid_hip") are the mean of left and right shoulder or hip,
/// with the smaller confidence.
inline Keypoints2d in_schema(const Keypoints2d& points, const KeypointSchema& from,
                             const KeypointSchema& to) {
  Keypoints2d result = Keypoints2d::Zero(static_cast<Index>(to.points.size()), 3);
  for (std::size_t i = 0; i < to.points.size(); ++i) {
    const auto row = static_cast<Index>(i);
    const int source = find_keypoint(from, to.points[i]);
    if (source >= 0) {
      result.row(row) = points.row(source);
      continue;
    }
    const std::string pair = to.points[i] == "neck"      ? "shoulder"
                             : to.points[i] == "mid_hip" ? "hip"
                                                         : "";
    const int left = find_keypoint(from, "left_" + pair);
    const int right = find_keypoint(from, "right_" + pair);
    if (left >= 0 && right >= 0 && points(left, 2) > 0 && points(right, 2) > 0) {
      result.row(row) = 0.5 * (points.row(left) + points.row(right));
      result(row, 2) = std::min(points(left, 2), points(right, 2));
    }
  }
  return result;
}

}  // namespace atelier::fixtures
