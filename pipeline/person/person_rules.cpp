#include "pipeline/person/person_rules.h"

#include "capture/worn_labels.h"

namespace atelier {
namespace {

/// Errors in lists of labels of the person's stages.
std::vector<std::string> broken_labels(const OptionTable& table) {
  std::vector<std::string> problems;
  for (const OptionField& field : table.fields) {
    if (start_of(field.name, "input.excluded")) {
      if (const std::string problem = excluded_problem(option_text(field)); !problem.empty()) {
        problems.push_back((field.source == "flag" ? "" : field.source + ": ") + field.name +
                           " cannot be " + problem);
      }
    }
  }
  return problems;
}

/// Corrections of a capture that a section takes with the others and nothing behind it reads: a
/// person is measured and tracked on what `reconstruct` has made of cameras and pictures. What
/// cameras there are (leave_out, sync, keypoints) may say which frames and keypoints there are.
constexpr std::string_view kPersonsCapture = "input.capture.";
constexpr std::array kUnread = {
    std::string_view("metres_per_unit"), std::string_view("up"),
    std::string_view("label_taxonomy"),  std::string_view("calibration_of"),
    std::string_view("extrinsics"),      std::string_view("baseline"),
    std::string_view("intrinsics"),      std::string_view("distortion"),
    std::string_view("pixel_shift"),     std::string_view("turned"),
    std::string_view("masks"),
};

std::vector<std::string> broken_inputs(const OptionTable& table) {
  std::vector<std::string> problems = broken_labels(table);
  for (const std::string_view name : kUnread) {
    for (const OptionField& field : table.fields) {
      if (is_said(field) && start_of(field.name, std::string(kPersonsCapture) += name)) {
        problems.push_back(field.name +
                           " does nothing: cameras and images are read by reconstruct alone; "
                           "leave it out here, and say it there");
      }
    }
  }
  return problems;
}

constexpr std::array kPersonOrder = {
    OrderRule{"overlap", "window", [](double a, double b) { return 2 * a <= b; },
              "it takes at most half of that"},
};

/// Of `personalize`: the surface is not displaced.
constexpr std::array<IdleRule::Value, 2> kNoSurface = {{{"surface_rounds", "0"}, {}}};
constexpr const char* kSurface = "more --surface-rounds";

constexpr std::array kPersonIdle = {
    IdleRule{"region", {{{"exclude", "auto"}, {}}}, "--exclude region"},
    IdleRule{"region", {{{"exclude", "labels"}, {}}}, "--exclude region"},
    IdleRule{"region", {{{"exclude", "none"}, {}}}, "--exclude region"},
    IdleRule{"dynamic.", {{{"exclude", "labels"}, {}}}, "--exclude auto"},
    IdleRule{"dynamic.", {{{"exclude", "region"}, {}}}, "--exclude auto"},
    IdleRule{"dynamic.", {{{"exclude", "none"}, {}}}, "--exclude auto"},
    IdleRule{"compare", {{{"exclude", "none"}, {}}}, "another --exclude"},
    IdleRule{"model_to_scan", {{{"rounds", "0"}, {}}}, "more --rounds"},
    IdleRule{"dynamic.", {{{"rounds", "0"}, {}}}, "more --rounds"},
    IdleRule{"surface_noise", kNoSurface, kSurface},
    IdleRule{"smoothness", kNoSurface, kSurface},
    IdleRule{"displacement", kNoSurface, kSurface},
};

constexpr std::array kBodyIdle = {
    IdleRule{"coupling_length", {{{"coupling", "false"}, {}}}, "--coupling true"},
    IdleRule{"temporal_weight", {{{"temporal", "false"}, {}}}, "--temporal true"},
    IdleRule{"around", {{{"temporal", "false"}, {}}}, "--temporal true"},
    IdleRule{"tight_scale", {{{"tight_weight", "0"}, {}}}, "more --tight-weight"},
    IdleRule{"skin_reach", {{{"skin_weight", "0"}, {}}}, "more --skin-weight"},
    IdleRule{"skin_scale", {{{"skin_weight", "0"}, {}}}, "more --skin-weight"},
    IdleRule{"outside_weight", {{{"sign", "unsigned"}, {}}}, "another --sign"},
    IdleRule{"gap_frames", {{{"gap", "0", true}, {}}}, "--gap 0"},
};

constexpr std::array kPersonNeeded = {
    NeededRule{"region",
               {"exclude", "region"},
               "--region: a vertex group of the body, or a JSON list of its vertices"},
    NeededRule{"input.excluded",
               {"exclude", "labels"},
               "--input.excluded: labels of what is worn, with commas between"},
};

}  // namespace

const OptionRules& person_rules() {
  static constexpr OptionRules rules{
      .order = kPersonOrder, .idle = kPersonIdle, .needed = kPersonNeeded, .others = broken_inputs};
  return rules;
}

const OptionRules& body_rules() {
  static constexpr OptionRules rules{.idle = kBodyIdle};
  return rules;
}

}  // namespace atelier
