#include "pipeline/appearance/appearance_rules.h"

#include "appearance/side_problem.h"

namespace atelier {
namespace {

/// Of a network's texture, whose sides only some numbers can be. 0 is the setting's own.
std::vector<std::string> broken_sides(const OptionTable& table) {
  std::vector<std::string> problems;
  for (const OptionField& shading : table.fields) {
    const auto start = start_of(shading.name, "shading");
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

const OptionRules& appearance_rules() {
  static constexpr OptionRules rules{.others = broken_sides};
  return rules;
}

}  // namespace atelier
