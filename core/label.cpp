#include "core/label.h"

#include <array>

namespace atelier {
namespace {

constexpr std::array kLabelNames = {"background", "skin",  "hair",  "upper", "lower",
                                    "dress",      "outer", "shoes", "other"};

}  // namespace

const std::vector<Label>& all_labels() {
  static const std::vector<Label> labels = {Label::Background, Label::Skin,  Label::Hair,
                                            Label::Upper,      Label::Lower, Label::Dress,
                                            Label::Outer,      Label::Shoes, Label::Other};
  return labels;
}

std::string label_name(Label label) {
  const auto index = static_cast<std::size_t>(label);
  return index < kLabelNames.size() ? kLabelNames[index] : "unknown";
}

std::optional<Label> label_of(std::string_view name) {
  for (const Label label : all_labels()) {
    if (label_name(label) == name) {
      return label;
    }
  }
  return name == "unknown" ? std::optional(Label::Unknown) : std::nullopt;
}

bool is_cloth(Label label) {
  return label == Label::Upper || label == Label::Lower || label == Label::Dress ||
         label == Label::Outer;
}

}  // namespace atelier
