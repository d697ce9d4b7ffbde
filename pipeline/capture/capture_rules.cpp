#include "pipeline/capture/capture_rules.h"

#include <algorithm>

#include "capture/layouts/corrections.h"

namespace atelier {
namespace {

/// Errors in corrections of a capture: texts that name cameras, of which options in general
/// know nothing. A table that has one of them has all.
std::vector<std::string> broken_corrections(const OptionTable& table) {
  const auto own = std::find_if(
      table.fields.begin(), table.fields.end(),
      [](const OptionField& field) { return start_of(field.name, "calibration_of").has_value(); });
  if (own == table.fields.end()) {
    return {};
  }
  const std::string start = *start_of(own->name, "calibration_of");
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

constexpr std::array kOrder = {
    OrderRule{"hull.voxel_size", "hull.half_extent", is_less, kTakesLess},
};

}  // namespace

const OptionRules& capture_rules() {
  static constexpr OptionRules rules{.order = kOrder, .others = broken_corrections};
  return rules;
}

}  // namespace atelier
