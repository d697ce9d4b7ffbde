#include "pipeline/row/option_rules.h"

#include <algorithm>
#include <utility>

namespace atelier {
namespace {

constexpr std::string_view kUnsaid = "default";  // as OptionField has it

/// The part of a name before its end; nothing where it ends otherwise.
std::optional<std::string> before(const std::string& name, std::string_view end) {
  if (!name.ends_with(end)) {
    return std::nullopt;
  }
  std::string start = name.substr(0, name.size() - end.size());
  return start.empty() || start.back() == '.' ? std::optional(std::move(start)) : std::nullopt;
}

/// The flags of an advice as the table's section has them: "--region" in "track." is
/// "--track.region".
std::string in_section(const std::string& start, std::string_view advice) {
  std::string flags;
  for (std::size_t i = 0; i < advice.size(); ++i) {
    flags += advice[i];
    if (flags.ends_with("--")) {
      std::string section = start;
      std::replace(section.begin(), section.end(), '_', '-');
      flags += section;
    }
  }
  return flags;
}

/// "with xpbd.sweep gauss-seidel", "without relax.body" if the field does nothing by this rule,
/// else "".
std::string idle_with(const OptionTable& table, const OptionField& field, const IdleRule& rule) {
  const auto start = start_of(field.name, rule.option);
  if (!start || !is_said(field)) {
    return "";
  }
  std::string with;
  for (const IdleRule::Value& value : rule.idle_with) {
    if (value.option.empty()) {
      continue;
    }
    const OptionField* other = field_named(table, *start + std::string(value.option));
    if (other == nullptr || (option_text(*other) == value.text) == value.other ||
        (rule.unless_said && is_said(*other))) {
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

void judge_order(const OptionTable& table, const OrderRule& rule,
                 std::vector<std::string>& problems) {
  for (const OptionField& first : table.fields) {
    const auto start = before(first.name, rule.first);
    const OptionField* second =
        start ? field_named(table, *start + std::string(rule.second)) : nullptr;
    if (second == nullptr) {
      continue;
    }
    const std::optional<double> a = number_of(first);
    const std::optional<double> b = number_of(*second);
    if (a && b && !rule.holds(*a, *b)) {
      problems.push_back(first.name + " cannot be " + option_text(first) + " with " + second->name +
                         " " + option_text(*second) + ": " + std::string(rule.wanted));
    }
  }
}

void judge_idle(const OptionTable& table, const IdleRule& rule,
                std::vector<std::string>& problems) {
  for (const OptionField& field : table.fields) {
    if (const std::string with = idle_with(table, field, rule); !with.empty()) {
      problems.push_back(field.name + " does nothing " + with + ": leave it out, or say " +
                         in_section(*start_of(field.name, rule.option), rule.wanted));
    }
  }
}

void judge_needed(const OptionTable& table, const NeededRule& rule,
                  std::vector<std::string>& problems) {
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

}  // namespace

bool is_less(double first, double second) {
  return first < second;
}

bool is_said(const OptionField& field) {
  return field.source != kUnsaid;
}

std::optional<std::string> start_of(const std::string& name, std::string_view end) {
  if (!end.ends_with(".")) {
    return before(name, end);
  }
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? std::nullopt : before(name.substr(0, dot + 1), end);
}

const OptionField* field_named(const OptionTable& table, const std::string& name) {
  const auto found = std::find_if(table.fields.begin(), table.fields.end(),
                                  [&](const OptionField& field) { return field.name == name; });
  return found == table.fields.end() ? nullptr : &*found;
}

std::optional<double> number_of(const OptionField& field) {
  if (const auto* const* value = std::get_if<int*>(&field.target)) {
    return **value;
  }
  if (const auto* const* value = std::get_if<double*>(&field.target)) {
    return **value;
  }
  return std::nullopt;
}

std::vector<std::string> broken_rules(const OptionTable& table, const OptionRules& rules) {
  std::vector<std::string> problems =
      rules.others == nullptr ? std::vector<std::string>() : rules.others(table);
  for (const OrderRule& rule : rules.order) {
    judge_order(table, rule, problems);
  }
  for (const IdleRule& rule : rules.idle) {
    judge_idle(table, rule, problems);
  }
  for (const NeededRule& rule : rules.needed) {
    judge_needed(table, rule, problems);
  }
  return problems;
}

}  // namespace atelier
