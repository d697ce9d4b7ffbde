#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/image.h"
#include "core/label.h"

namespace atelier {

/// A taxonomy of label images that is mapped to ours.
struct LabelTaxonomy {
  std::string name;                ///< "atelier", "lip", "cihp", "atr", "goliath_28", "4d_dress"
  std::vector<std::string> names;  ///< of its numbers, from 0
  std::vector<Label> labels;       ///< what each number is
  /// sRGB of each number where label images are colour images (4D-DRESS); else empty.
  std::vector<std::array<std::uint8_t, 3>> colors;
};

/// Every taxonomy by name. Sources: LIP and CIHP (Gong et al. 2017, 2018; the two differ in number
/// 10: jumpsuits against skin of the torso), ATR (Liang et al. 2015), Goliath's 28 classes of
/// Sapiens (Khirodkar et al. 2024), 4D-DRESS (Wang et al. 2024).
const std::vector<std::string>& label_taxonomy_names();

/// By name. Throws DataError for an unknown one, with the nearest.
const LabelTaxonomy& label_taxonomy(std::string_view name);

/// A label image in our taxonomy. One channel: numbers; 255 stays Unknown; numbers that the
/// taxonomy does not have throw DataError (`file` in it) with the number and pixel. Three channels:
/// colours of taxonomies that have some; white is background, any other colour Unknown.
ByteImage to_atelier_labels(const ByteImage& labels, const LabelTaxonomy& taxonomy,
                            const std::string& file = "");

}  // namespace atelier
