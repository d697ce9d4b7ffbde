#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// Class of a surface or a pixel: the taxonomy "atelier" that every other one is mapped to. Numbers
/// are those of label images and of Mesh::labels. Tight minimal clothing counts as skin.
enum class Label : std::uint8_t {
  Background = 0,
  Skin = 1,
  Hair = 2,
  Upper = 3,  ///< tee, shirt, blouse
  Lower = 4,  ///< trousers, skirt
  Dress = 5,  ///< one piece from above to below the waist
  Outer = 6,  ///< jacket, coat
  Shoes = 7,  ///< shoes and socks
  Other = 8,  ///< hat, bag, glasses
  Unknown = 255,
};

/// Every label but Unknown, in the order of their numbers.
const std::vector<Label>& all_labels();

/// "background", "skin", "upper", ...
std::string label_name(Label label);

/// The label of that name; nothing if there is none.
std::optional<Label> label_of(std::string_view name);

/// True for clothing that drapes: upper, lower, dress, outer.
bool is_cloth(Label label);

}  // namespace atelier
