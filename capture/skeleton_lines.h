#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "capture/keypoint_schema.h"

namespace atelier {

/// How much of a person drawn lines join.
enum class SkeletonDetail {
  Limbs,  ///< torso, arms, legs, head and big toes: for small images
  Full,   ///< also shoulders with neck, heels, eyes and ears
};

/// Pairs of points that a drawing joins by lines, as places in the schema: those of which it has
/// both ends.
inline std::vector<std::array<int, 2>> skeleton_lines(const KeypointSchema& schema,
                                                      SkeletonDetail detail) {
  constexpr std::size_t kLimbs = 16;
  constexpr std::array<std::array<std::string_view, 2>, 24> kLines = {{
      {"nose", "neck"},
      {"neck", "mid_hip"},
      {"left_shoulder", "right_shoulder"},
      {"left_shoulder", "left_elbow"},
      {"left_elbow", "left_wrist"},
      {"right_shoulder", "right_elbow"},
      {"right_elbow", "right_wrist"},
      {"left_shoulder", "left_hip"},
      {"right_shoulder", "right_hip"},
      {"left_hip", "right_hip"},
      {"left_hip", "left_knee"},
      {"left_knee", "left_ankle"},
      {"right_hip", "right_knee"},
      {"right_knee", "right_ankle"},
      {"left_ankle", "left_big_toe"},
      {"right_ankle", "right_big_toe"},
      // those of full detail
      {"neck", "left_shoulder"},
      {"neck", "right_shoulder"},
      {"left_ankle", "left_heel"},
      {"right_ankle", "right_heel"},
      {"nose", "left_eye"},
      {"nose", "right_eye"},
      {"left_eye", "left_ear"},
      {"right_eye", "right_ear"},
  }};
  std::vector<std::array<int, 2>> lines;
  for (std::size_t i = 0; i < (detail == SkeletonDetail::Full ? kLines.size() : kLimbs); ++i) {
    const int a = find_keypoint(schema, kLines[i][0]);
    const int b = find_keypoint(schema, kLines[i][1]);
    if (a >= 0 && b >= 0) {
      lines.push_back({a, b});
    }
  }
  return lines;
}

}  // namespace atelier
