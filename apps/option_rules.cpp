#include "apps/option_rules.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <string_view>

#include "capture/layouts/corrections.h"

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

/// 0 is the setting's own.
bool power_of_two(double value) {
  return value == 0 || std::has_single_bit(static_cast<unsigned>(value));
}

constexpr const char* kLess = "it takes less than that";
constexpr std::array kRules = {
    OptionRule{"search.stretch_low", "search.stretch_high", less, kLess},
    OptionRule{"search.bending_low", "search.bending_high", less, kLess},
    OptionRule{"hull.cell", "hull.reach", less, kLess},
    OptionRule{"overlap", "window", [](double a, double b) { return 2 * a <= b; },
               "it takes at most half of that"},
    OptionRule{"resolution", "shading",
               [](double a, double b) {
                 return power_of_two(a) && (a == 0 || a >= 16) && power_of_two(b);
               },
               "they take powers of 2, from 16 and from 1, or 0"},
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

}  // namespace

std::vector<std::string> broken_rules(const OptionTable& table) {
  std::vector<std::string> problems = broken_corrections(table);
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
  return problems;
}

}  // namespace atelier
