#pragma once

#include <vector>

#include "capture/detection/network.h"

namespace atelier::fixtures {

/// Outputs of a person detector that sees nobody.
inline std::vector<NetworkOutput> nobody_outputs() {
  return {{"scores", {2254, 1}, std::vector<float>(2254, -20.0F)},
          {"boxes", {2254, 12}, std::vector<float>(std::size_t{2254} * 12, 0.0F)}};
}

/// Outputs of a landmark network: every point at pixel (128, 128) of its input, sure of a person
/// whose mask is everywhere, flat heatmaps.
inline std::vector<NetworkOutput> middle_outputs() {
  std::vector<float> rows(std::size_t{39} * 5, 0.0F);
  for (std::size_t k = 0; k < 39; ++k) {
    rows[5 * k] = rows[5 * k + 1] = 128;
    rows[5 * k + 3] = 4;  // logit of the visibility
  }
  return {{"mask", {1, 256, 256}, std::vector<float>(std::size_t{256} * 256, 30.0F)},
          {"maps", {39, 64, 64}, std::vector<float>(std::size_t{39} * 64 * 64, -30.0F)},
          {"rows", {195}, rows},
          {"world", {117}, std::vector<float>(117, 0.0F)},
          {"presence", {1}, {0.9F}}};
}

}  // namespace atelier::fixtures
