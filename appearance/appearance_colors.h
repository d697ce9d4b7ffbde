#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/archive.h"

namespace atelier {

/// Colours that a network renders at the pixels of all views of an AppearanceData, one view behind
/// the other: linear RGB without gain.
struct AppearanceColors {
  std::vector<float> drawn;  ///< [3P]
  std::vector<float> fixed;  ///< [3P] by the texture that does not change
};

/// By what a network multiplies its mean texture: nearly all of it lies between. Linear.
struct DrawnRange {
  double low = 1;
  double high = 1;
};

/// The 1st and the 999th thousandth of what channels are drawn with over what they are at rest;
/// those that are nearly black say nothing. 1 and 1 of no pixels.
DrawnRange drawn_range(const AppearanceColors& colors);

/// Archive of schema "atelier.appearance_colors", version 1 (docs/reference/formats.md), and back.
/// Reading throws DataError unless there are finite colours of `pixels` pixels, and nothing else.
Archive archive_of(const AppearanceColors& colors);
AppearanceColors appearance_colors_of(const Archive& archive, std::int64_t pixels,
                                      const std::string& file = "");

}  // namespace atelier
