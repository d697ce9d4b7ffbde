#pragma once

#include <cmath>
#include <string>

#include "core/limits.h"

namespace atelier {

/// True for a number of pixels that a side of a camera's image may have: 1 to
/// Limits::camera_side, whole (some layouts write 1080.0).
inline bool is_camera_side(double pixels) {
  return pixels >= 1 && pixels <= static_cast<double>(Limits{}.camera_side) &&
         pixels == std::floor(pixels);
}

/// Those numbers in words, for error messages.
inline std::string camera_side_range() {
  return "a whole number from 1 to " + std::to_string(Limits{}.camera_side);
}

}  // namespace atelier
