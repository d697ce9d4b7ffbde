#include "pipeline/animation/animate_rules.h"

#include <algorithm>

#include "pipeline/pictures/animation_pictures.h"

namespace atelier {
namespace {

/// Options of `animate` that place the camera round the subject, beside a camera of the capture,
/// which has a place and a size of its own.
std::vector<std::string> idle_framing(const OptionTable& table) {
  std::vector<std::string> problems;
  for (const OptionField& field : table.fields) {
    for (const std::string_view placing : {"width", "height", "framing."}) {
      const auto start = start_of(field.name, placing);
      if (!start || !is_said(field) || !field_named(table, *start + "drawn_by")) {
        continue;
      }
      const OptionField* camera = field_named(table, *start + "camera");
      const std::string looks = camera != nullptr ? option_text(*camera) : "";
      if (std::find(kAnimationViews.begin(), kAnimationViews.end(), looks) ==
          kAnimationViews.end()) {
        problems.push_back(field.name + " does nothing with camera " + looks +
                           ", which is the capture's: leave one of them out");
      }
    }
  }
  return problems;
}

/// Of `animate`, whose table alone says by false that there are none.
constexpr std::array<IdleRule::Value, 2> kNoPictures = {{{"pictures", "false"}, {}}};
constexpr const char* kPictures = "--pictures";

constexpr std::array kAnimateIdle = {
    IdleRule{"camera", kNoPictures, kPictures},
    IdleRule{"background", kNoPictures, kPictures},
    IdleRule{"drawn_by", kNoPictures, kPictures},
    IdleRule{"width", kNoPictures, kPictures},
    IdleRule{"height", kNoPictures, kPictures},
    IdleRule{"samples", kNoPictures, kPictures},
    IdleRule{"framing.", kNoPictures, kPictures},
    IdleRule{"mark", kNoPictures, kPictures},
    IdleRule{"sign", kNoPictures, kPictures},
    IdleRule{"sign", {{{"mark", "false"}, {}}}, "--mark"},
    IdleRule{"holding", {{{"garment", "auto", true}, {}}}, "--garment auto"},
};

}  // namespace

const OptionRules& animate_rules() {
  static constexpr OptionRules rules{.idle = kAnimateIdle, .others = idle_framing};
  return rules;
}

}  // namespace atelier
