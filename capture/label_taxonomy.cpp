#include "capture/label_taxonomy.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "core/nearest_name.h"

namespace atelier {
namespace {

constexpr Label kBackground = Label::Background;
constexpr Label kSkin = Label::Skin;
constexpr Label kHair = Label::Hair;
constexpr Label kUpper = Label::Upper;
constexpr Label kLower = Label::Lower;
constexpr Label kDress = Label::Dress;
constexpr Label kOuter = Label::Outer;
constexpr Label kShoes = Label::Shoes;
constexpr Label kOther = Label::Other;

/// LIP, or CIHP, which is the same but for number 10.
LabelTaxonomy lip_like(std::string name, const std::string& tenth, Label tenth_label) {
  return {
      std::move(name),
      {"background", "hat",       "hair",     "glove",     "sunglasses", "upper-clothes", "dress",
       "coat",       "socks",     "pants",    tenth,       "scarf",      "skirt",         "face",
       "left-arm",   "right-arm", "left-leg", "right-leg", "left-shoe",  "right-shoe"},
      {kBackground, kOther, kHair,  kOther, kOther, kUpper, kDress, kOuter, kShoes, kLower,
       tenth_label, kOther, kLower, kSkin,  kSkin,  kSkin,  kSkin,  kSkin,  kShoes, kShoes},
      {}};
}

LabelTaxonomy atelier_taxonomy() {
  LabelTaxonomy taxonomy{"atelier", {}, all_labels(), {}};
  for (const Label label : all_labels()) {
    taxonomy.names.push_back(label_name(label));
  }
  return taxonomy;
}

const std::vector<LabelTaxonomy>& all_taxonomies() {
  static const std::vector<LabelTaxonomy> taxonomies = {
      atelier_taxonomy(),
      lip_like("lip", "jumpsuits", kDress),
      lip_like("cihp", "torso-skin", kSkin),
      {"atr",
       {"background", "hat", "hair", "sunglasses", "upper-clothes", "skirt", "pants", "dress",
        "belt", "left-shoe", "right-shoe", "face", "left-leg", "right-leg", "left-arm", "right-arm",
        "bag", "scarf"},
       {kBackground, kOther, kHair, kOther, kUpper, kLower, kLower, kDress, kOther, kShoes, kShoes,
        kSkin, kSkin, kSkin, kSkin, kSkin, kOther, kOther},
       {}},
      {"goliath_28",
       {"Background",      "Apparel",         "Face_Neck",      "Hair",       "Left_Foot",
        "Left_Hand",       "Left_Lower_Arm",  "Left_Lower_Leg", "Left_Shoe",  "Left_Sock",
        "Left_Upper_Arm",  "Left_Upper_Leg",  "Lower_Clothing", "Right_Foot", "Right_Hand",
        "Right_Lower_Arm", "Right_Lower_Leg", "Right_Shoe",     "Right_Sock", "Right_Upper_Arm",
        "Right_Upper_Leg", "Torso",           "Upper_Clothing", "Lower_Lip",  "Upper_Lip",
        "Lower_Teeth",     "Upper_Teeth",     "Tongue"},
       {kBackground, kOther, kSkin,  kHair, kSkin, kSkin, kSkin, kSkin,  kShoes, kShoes,
        kSkin,       kSkin,  kLower, kSkin, kSkin, kSkin, kSkin, kShoes, kShoes, kSkin,
        kSkin,       kSkin,  kUpper, kSkin, kSkin, kSkin, kSkin, kSkin},
       {}},
      {"4d_dress",
       {"skin", "hair", "shoe", "upper", "lower", "outer"},
       {kSkin, kHair, kShoes, kUpper, kLower, kOuter},
       {{128, 128, 128},
        {255, 128, 0},
        {128, 0, 255},
        {180, 50, 50},
        {50, 180, 50},
        {0, 128, 255}}}};
  return taxonomies;
}

}  // namespace

const std::vector<std::string>& label_taxonomy_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const LabelTaxonomy& taxonomy : all_taxonomies()) {
      result.push_back(taxonomy.name);
    }
    return result;
  }();
  return names;
}

const LabelTaxonomy& label_taxonomy(std::string_view name) {
  for (const LabelTaxonomy& taxonomy : all_taxonomies()) {
    if (taxonomy.name == name) {
      return taxonomy;
    }
  }
  std::string known;
  for (const std::string& other : label_taxonomy_names()) {
    known += (known.empty() ? "" : ", ") + other;
  }
  throw DataError("", "label_taxonomy", "'" + std::string(name.substr(0, 60)) + "'",
                  "one of " + known + did_you_mean(name, label_taxonomy_names()));
}

ByteImage to_atelier_labels(const ByteImage& labels, const LabelTaxonomy& taxonomy,
                            const std::string& file) {
  if (labels.channels != 1 && (labels.channels != 3 || taxonomy.colors.empty())) {
    throw DataError(file, "", "an image of " + std::to_string(labels.channels) + " channels",
                    "labels of " + taxonomy.name + ", one channel");
  }
  ByteImage result(labels.width, labels.height, 1);
  for (std::size_t i = 0; i < result.data.size(); ++i) {
    Label label = Label::Unknown;
    if (labels.channels == 1) {
      const std::uint8_t number = labels.data[i];
      if (number < taxonomy.labels.size()) {
        label = taxonomy.labels[number];
      } else if (number != static_cast<std::uint8_t>(Label::Unknown)) {
        const auto width = static_cast<std::size_t>(labels.width);
        throw DataError(
            file, "pixel (" + std::to_string(i % width) + ", " + std::to_string(i / width) + ")",
            "label " + std::to_string(number),
            "numbers below " + std::to_string(taxonomy.labels.size()) + ", those of the taxonomy " +
                taxonomy.name + ", or 255");
      }
    } else {
      const std::array<std::uint8_t, 3> color = {labels.data[3 * i], labels.data[3 * i + 1],
                                                 labels.data[3 * i + 2]};
      const auto found = std::find(taxonomy.colors.begin(), taxonomy.colors.end(), color);
      if (found != taxonomy.colors.end()) {
        label = taxonomy.labels[static_cast<std::size_t>(found - taxonomy.colors.begin())];
      } else if (color == std::array<std::uint8_t, 3>{255, 255, 255}) {
        label = Label::Background;
      }
    }
    result.data[i] = static_cast<std::uint8_t>(label);
  }
  return result;
}

}  // namespace atelier
