#pragma once

#include <algorithm>
#include <bit>
#include <string>

namespace atelier {

/// "", or why a number of texels, or of texels along one, is none, with the nearest that are:
/// "resolution cannot be 17: it takes powers of 2 from 16 to 2048, as 16 or 32".
/// @param least, most  powers of 2
inline std::string side_problem(const std::string& option, int value, int least, int most) {
  if (value >= least && value <= most && std::has_single_bit(static_cast<unsigned>(value))) {
    return "";
  }
  const auto within = static_cast<unsigned>(std::clamp(value, least, most));
  const unsigned below = std::bit_floor(within);
  const unsigned above = std::bit_ceil(within);
  return option + " cannot be " + std::to_string(value) + ": it takes powers of 2 from " +
         std::to_string(least) + " to " + std::to_string(most) + ", as " + std::to_string(below) +
         (above != below ? " or " + std::to_string(above) : "");
}

/// Of a texture, and of its texels along one of the branches'.
inline std::string resolution_problem(const std::string& option, int value) {
  constexpr int kLeast = 16;
  constexpr int kMost = 2048;
  return side_problem(option, value, kLeast, kMost);
}
inline std::string shading_problem(const std::string& option, int value) {
  constexpr int kMost = 16;
  return side_problem(option, value, 1, kMost);
}

}  // namespace atelier
