#include "apps/console/option_rules.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "appearance/side_problem.h"
#include "apps/console/option_flags.h"
#include "capture/layouts/corrections.h"
#include "capture/worn_labels.h"
#include "pipeline/pictures/animation_pictures.h"

namespace atelier {
namespace {

/// Of two numbers, by the ends of their options' names: any table that has both has to keep it.
struct OptionRule {
  std::string_view first;
  std::string_view second;
  bool (*holds)(double first, double second);
  std::string_view wanted;
};

bool less(double first, double second) {
  return first < second;
}

constexpr std::string_view kUnsaid = "default";  // as OptionField has it
constexpr const char* kLess = "it takes less than that";
constexpr std::array kRules = {
    OptionRule{"search.stretch_low", "search.stretch_high", less, kLess},
    OptionRule{"search.bending_low", "search.bending_high", less, kLess},
    OptionRule{"hull.voxel_size", "hull.half_extent", less, kLess},
    OptionRule{"overlap", "window", [](double a, double b) { return 2 * a <= b; },
               "it takes at most half of that"},
};

/// What is said and does nothing while others have these values. A name that ends in "." is a
/// section.
struct IdleRule {
  struct Value {
    std::string_view option;
    std::string_view text;
    bool other = false;  ///< any text but this
  };
  std::string_view option;
  std::array<Value, 2> idle_with;  ///< the second may be empty
  std::string_view wanted;
  bool unless_said = false;  ///< said to be off by hand, the rest stays as it is: a comparison
};

/// Of `material`, whose table alone has a search: with a fabric nothing is tried.
constexpr std::array<IdleRule::Value, 2> kFabricGiven = {
    {{"material.name", "fitted", true}, {"search.coarse", "", true}}};
constexpr const char* kFitted = "--material.name fitted";

/// Of `flatten`, whose table alone has such a search.
constexpr std::array<IdleRule::Value, 2> kSeamsGiven = {
    {{"seams", "auto", true}, {"find.cuts", "", true}}};
constexpr const char* kSeamsFound = "--seams auto";

/// Of `animate`, whose table alone says by false that there are none.
constexpr std::array<IdleRule::Value, 2> kNoPictures = {{{"pictures", "false"}, {}}};
constexpr const char* kPictures = "--pictures";

constexpr std::array<IdleRule::Value, 2> kNoBody = {{{"relax.body", ""}, {}}};
constexpr const char* kHungOnBody = "--relax.body";

/// Of `personalize`: the surface is not displaced.
constexpr std::array<IdleRule::Value, 2> kNoSurface = {{{"surface_rounds", "0"}, {}}};
constexpr const char* kSurface = "more --surface-rounds";

constexpr std::array kIdleRules = {
    IdleRule{"search.", kFabricGiven, kFitted},
    IdleRule{"use_prior", kFabricGiven, kFitted},
    IdleRule{"tracking_rate", kFabricGiven, kFitted},
    IdleRule{"sequence", kFabricGiven, kFitted},
    IdleRule{"frames", kFabricGiven, kFitted},
    IdleRule{"edge_length", kFabricGiven, kFitted},
    IdleRule{"substeps", kFabricGiven, kFitted},
    IdleRule{"self_contact", kFabricGiven, kFitted},
    IdleRule{"material.shear",
             {{{"membrane", "springs"}, {"shear", "none"}}},
             "--shear cross or --membrane strain"},
    IdleRule{"wind", {{{"xpbd.air_density", "0"}, {}}}, "more --xpbd.air-density"},
    IdleRule{"xpbd.drag", {{{"xpbd.air_density", "0"}, {}}}, "more --xpbd.air-density"},
    IdleRule{"xpbd.lift", {{{"xpbd.air_density", "0"}, {}}}, "more --xpbd.air-density"},
    IdleRule{"xpbd.air_density",
             {{{"xpbd.drag", "0"}, {"xpbd.lift", "0"}}},
             "--xpbd.drag or --xpbd.lift"},
    IdleRule{"relaxing.", {{{"relax", "false"}, {}}}, "--relax", true},
    // Of `flatten`, which seeks seams where none are given, and relaxes on a body to hang on.
    IdleRule{"tolerance", kSeamsGiven, kSeamsFound},
    IdleRule{"find.", kSeamsGiven, kSeamsFound},
    IdleRule{"relax.fabric", kNoBody, kHungOnBody},
    IdleRule{"relax.registered", kNoBody, kHungOnBody},
    IdleRule{"relax.gap", kNoBody, kHungOnBody},
    IdleRule{"relax.substeps", kNoBody, kHungOnBody},
    IdleRule{"relax.relaxing.", kNoBody, kHungOnBody},
    IdleRule{"camera", kNoPictures, kPictures},
    IdleRule{"background", kNoPictures, kPictures},
    IdleRule{"drawn_by", kNoPictures, kPictures},
    IdleRule{"width", kNoPictures, kPictures},
    IdleRule{"height", kNoPictures, kPictures},
    IdleRule{"samples", kNoPictures, kPictures},
    IdleRule{"framing.", kNoPictures, kPictures},
    // Of `simulate`, whose table alone has seams: it takes the angles of the shape that was found.
    IdleRule{"rest_angles", {{{"relax", "true"}, {"sewn", "", true}}}, "--relax false"},
    IdleRule{"seam_stiffness", {{{"sewn", "true"}, {}}}, "--sewn false"},
    IdleRule{"xpbd.jacobi_radius", {{{"xpbd.sweep", "gauss-seidel"}, {}}}, "--xpbd.sweep jacobi"},
    IdleRule{"xpbd.self_thickness", {{{"xpbd.self_contact", "false"}, {}}}, "--xpbd.self-contact"},
    IdleRule{"xpbd.self_friction", {{{"xpbd.self_contact", "false"}, {}}}, "--xpbd.self-contact"},
    IdleRule{"region", {{{"exclude", "auto"}, {}}}, "--exclude region"},
    IdleRule{"region", {{{"exclude", "labels"}, {}}}, "--exclude region"},
    IdleRule{"region", {{{"exclude", "none"}, {}}}, "--exclude region"},
    IdleRule{"dynamic.", {{{"exclude", "labels"}, {}}}, "--exclude auto"},
    IdleRule{"dynamic.", {{{"exclude", "region"}, {}}}, "--exclude auto"},
    IdleRule{"dynamic.", {{{"exclude", "none"}, {}}}, "--exclude auto"},
    IdleRule{"compare", {{{"exclude", "none"}, {}}}, "another --exclude"},
    // Of `track` and `personalize`.
    IdleRule{"model_to_scan", {{{"rounds", "0"}, {}}}, "more --rounds"},
    IdleRule{"dynamic.", {{{"rounds", "0"}, {}}}, "more --rounds"},
    IdleRule{"surface_noise", kNoSurface, kSurface},
    IdleRule{"smoothness", kNoSurface, kSurface},
    IdleRule{"displacement", kNoSurface, kSurface},
    // Of `body` and `refine`.
    IdleRule{"coupling_length", {{{"coupling", "false"}, {}}}, "--coupling true"},
    IdleRule{"temporal_weight", {{{"temporal", "false"}, {}}}, "--temporal true"},
    IdleRule{"around", {{{"temporal", "false"}, {}}}, "--temporal true"},
    IdleRule{"tight_scale", {{{"tight_weight", "0"}, {}}}, "more --tight-weight"},
    IdleRule{"skin_reach", {{{"skin_weight", "0"}, {}}}, "more --skin-weight"},
    IdleRule{"skin_scale", {{{"skin_weight", "0"}, {}}}, "more --skin-weight"},
    IdleRule{"outside_weight", {{{"sign", "unsigned"}, {}}}, "another --sign"},
    IdleRule{"gap_frames", {{{"gap", "0", true}, {}}}, "--gap 0"},
    IdleRule{"xpbd.self_interval", {{{"xpbd.self_contact", "false"}, {}}}, "--xpbd.self-contact"},
};

/// A text that another option's value asks for.
struct NeededRule {
  std::string_view option;
  IdleRule::Value asked_by;
  std::string_view wanted;
};

constexpr std::array kNeededRules = {
    NeededRule{"region",
               {"exclude", "region"},
               "--region: a vertex group of the body, or a JSON list of its vertices"},
    NeededRule{"input.excluded",
               {"exclude", "labels"},
               "--input.excluded: labels of what is worn, with commas between"},
};

/// Corrections of a capture that a section takes with the others and nothing behind it reads: a
/// person is measured and tracked on what `reconstruct` has made of cameras and pictures. What
/// cameras there are (leave_out, sync, keypoints) may say which frames and keypoints there are.
constexpr std::string_view kPersonsCapture = "input.capture.";
constexpr std::array kUnread = {
    std::string_view("metres_per_unit"), std::string_view("up"),
    std::string_view("label_taxonomy"),  std::string_view("calibration_of"),
    std::string_view("extrinsics"),      std::string_view("baseline"),
    std::string_view("intrinsics"),      std::string_view("distortion"),
    std::string_view("pixel_shift"),     std::string_view("masks"),
};

std::optional<double> number_of(const OptionField& field) {
  if (const auto* const* value = std::get_if<int*>(&field.target)) {
    return **value;
  }
  if (const auto* const* value = std::get_if<double*>(&field.target)) {
    return **value;
  }
  return std::nullopt;
}

/// What stands before the end of a name: "material." of "material.search.stretch_low"; nothing
/// where it ends otherwise.
std::optional<std::string> before(const std::string& name, std::string_view end) {
  if (!name.ends_with(end)) {
    return std::nullopt;
  }
  std::string start = name.substr(0, name.size() - end.size());
  return start.empty() || start.back() == '.' ? std::optional(std::move(start)) : std::nullopt;
}

/// What is wrong in corrections of a capture: texts that name cameras, of which options in general
/// know nothing. A table that has one of them has all.
std::vector<std::string> broken_corrections(const OptionTable& table) {
  const auto own = std::find_if(
      table.fields.begin(), table.fields.end(),
      [](const OptionField& field) { return before(field.name, "calibration_of").has_value(); });
  if (own == table.fields.end()) {
    return {};
  }
  const std::string start = *before(own->name, "calibration_of");
  std::vector<std::string> problems;
  for (const OptionField& field : table.fields) {
    const auto* const* text = std::get_if<std::string*>(&field.target);
    if (text == nullptr || !field.name.starts_with(start)) {
      continue;
    }
    const std::string problem = correction_problem(field.name.substr(start.size()), **text);
    if (!problem.empty()) {
      problems.push_back((field.source == "flag" ? "" : field.source + ": ") + field.name + " " +
                         problem);
    }
  }
  return problems;
}

/// What is wrong in lists of labels of the person's stages.
std::vector<std::string> broken_labels(const OptionTable& table) {
  std::vector<std::string> problems;
  for (const OptionField& field : table.fields) {
    if (before(field.name, "input.excluded")) {
      if (const std::string problem = excluded_problem(option_text(field)); !problem.empty()) {
        problems.push_back((field.source == "flag" ? "" : field.source + ": ") + field.name +
                           " cannot be " + problem);
      }
    }
  }
  return problems;
}

/// The start of the name, as `before` has it, also of an option in a section.
std::optional<std::string> start_of(const std::string& name, std::string_view option) {
  if (!option.ends_with(".")) {
    return before(name, option);
  }
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? std::nullopt : before(name.substr(0, dot + 1), option);
}

/// The flags of an advice as the table's section has them: "--region" in "track." is
/// "--track.region".
std::string in_section(const std::string& start, std::string_view advice) {
  std::string flags;
  for (std::size_t i = 0; i < advice.size(); ++i) {
    flags += advice[i];
    if (flags.ends_with("--")) {
      flags += flag_of(start).substr(2);
    }
  }
  return flags;
}

const OptionField* field_named(const OptionTable& table, const std::string& name) {
  const auto found = std::find_if(table.fields.begin(), table.fields.end(),
                                  [&](const OptionField& field) { return field.name == name; });
  return found == table.fields.end() ? nullptr : &*found;
}

/// "with xpbd.sweep gauss-seidel", "without relax.body" if the field does nothing by this rule,
/// else "".
std::string idle_with(const OptionTable& table, const OptionField& field, const IdleRule& rule) {
  const auto start = start_of(field.name, rule.option);
  if (!start || field.source == kUnsaid) {
    return "";
  }
  std::string with;
  for (const IdleRule::Value& value : rule.idle_with) {
    if (value.option.empty()) {
      continue;
    }
    const OptionField* other = field_named(table, *start + std::string(value.option));
    if (other == nullptr || (option_text(*other) == value.text) == value.other ||
        (rule.unless_said && other->source != kUnsaid)) {
      return "";
    }
    const bool unsaid = value.text.empty() && !value.other;
    if (unsaid || !value.text.empty()) {  // an option that is there at all is no reason by itself
      with += (with.empty() ? (unsaid ? "without " : "with ") : " and ") + other->name +
              (unsaid ? "" : " " + option_text(*other));
    }
  }
  return with;
}

/// What places the camera round the subject, of `animate`, beside a camera of the capture, which
/// has a place and a size of its own.
std::vector<std::string> idle_framing(const OptionTable& table) {
  std::vector<std::string> problems;
  for (const OptionField& field : table.fields) {
    for (const std::string_view placing : {"width", "height", "framing."}) {
      const auto start = start_of(field.name, placing);
      if (!start || field.source == kUnsaid || !field_named(table, *start + "drawn_by")) {
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

/// Of a network's texture, whose sides only some numbers can be. 0 is the setting's own.
std::vector<std::string> broken_sides(const OptionTable& table) {
  std::vector<std::string> problems;
  for (const OptionField& shading : table.fields) {
    const auto start = before(shading.name, "shading");
    const OptionField* resolution = start ? field_named(table, *start + "resolution") : nullptr;
    if (resolution == nullptr) {
      continue;
    }
    const auto judge = [&](const OptionField& field, const auto& problem_of) {
      const int value = static_cast<int>(number_of(field).value_or(0));
      const std::string problem = value == 0 ? "" : problem_of(field.name, value);
      if (!problem.empty()) {
        problems.push_back(problem + "; 0: as the setting");
      }
    };
    judge(*resolution, resolution_problem);
    judge(shading, shading_problem);
  }
  return problems;
}

}  // namespace

std::vector<std::string> broken_rules(const OptionTable& table) {
  std::vector<std::string> problems = broken_corrections(table);
  for (std::string& problem : broken_sides(table)) {
    problems.push_back(std::move(problem));
  }
  for (std::string& problem : broken_labels(table)) {
    problems.push_back(std::move(problem));
  }
  for (std::string& problem : idle_framing(table)) {
    problems.push_back(std::move(problem));
  }
  for (const OptionRule& rule : kRules) {
    for (const OptionField& first : table.fields) {
      const auto start = before(first.name, rule.first);
      const auto second =
          std::find_if(table.fields.begin(), table.fields.end(), [&](const OptionField& field) {
            return start && field.name == *start + std::string(rule.second);
          });
      if (second == table.fields.end()) {
        continue;
      }
      const std::optional<double> a = number_of(first);
      const std::optional<double> b = number_of(*second);
      if (a && b && !rule.holds(*a, *b)) {
        problems.push_back(first.name + " cannot be " + option_text(first) + " with " +
                           second->name + " " + option_text(*second) + ": " +
                           std::string(rule.wanted));
      }
    }
  }
  for (const IdleRule& rule : kIdleRules) {
    for (const OptionField& field : table.fields) {
      if (const std::string with = idle_with(table, field, rule); !with.empty()) {
        problems.push_back(field.name + " does nothing " + with + ": leave it out, or say " +
                           in_section(*start_of(field.name, rule.option), rule.wanted));
      }
    }
  }
  for (const std::string_view name : kUnread) {
    for (const OptionField& field : table.fields) {
      if (field.source != kUnsaid && before(field.name, std::string(kPersonsCapture) += name)) {
        problems.push_back(field.name +
                           " does nothing: cameras and images are read by reconstruct alone; "
                           "leave it out here, and say it there");
      }
    }
  }
  for (const NeededRule& rule : kNeededRules) {
    for (const OptionField& field : table.fields) {
      const auto start = before(field.name, rule.option);
      const OptionField* asking =
          start ? field_named(table, *start + std::string(rule.asked_by.option)) : nullptr;
      if (asking != nullptr && option_text(*asking) == rule.asked_by.text &&
          option_text(field).empty()) {
        problems.push_back(asking->name + " " + std::string(rule.asked_by.text) + " takes " +
                           in_section(*start, rule.wanted));
      }
    }
  }
  return problems;
}

}  // namespace atelier
