#include "core/options.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>

#include "core/error.h"
#include "core/limits.h"
#include "core/nearest_name.h"
#include "core/printable.h"
#include "core/renamed_options.h"
#include "core/saturating_cast.h"
#include "core/utf8.h"

namespace atelier {
namespace {

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;  // clang 14 does not deduce it by itself

bool is_option_name(std::string_view name) {
  bool word_starts = true;
  for (const char c : name) {
    if (c == '.' && !word_starts) {
      word_starts = true;
    } else if ((c >= 'a' && c <= 'z') || (!word_starts && ((c >= '0' && c <= '9') || c == '_'))) {
      word_starts = false;
    } else {
      return false;
    }
  }
  return !word_starts;
}

template <class Number>
std::string number_text(Number value) {
  std::array<char, 32> text;
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

template <class Number>
std::optional<Number> number_of(std::string_view text) {
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (!text.empty() && text.front() == '-') {
      return std::nullopt;
    }
  }
  Number value{};
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) {
    return std::nullopt;
  }
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(value)) {
      return std::nullopt;
    }
  }
  return value;
}

std::string_view trimmed(std::string_view text) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
  while (!text.empty() && is_space(text.front())) {
    text.remove_prefix(1);
  }
  while (!text.empty() && is_space(text.back())) {
    text.remove_suffix(1);
  }
  return text;
}

std::optional<std::vector<double>> numbers_of(std::string_view text) {
  text = trimmed(text);
  if (text.size() >= 2 && text.front() == '[' && text.back() == ']') {
    text = trimmed(text.substr(1, text.size() - 2));
  }
  std::vector<double> values;
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    const auto value = number_of<double>(trimmed(text.substr(0, comma)));
    if (!value) {
      return std::nullopt;
    }
    values.push_back(*value);
    if (comma == std::string_view::npos) {
      return values;
    }
    text.remove_prefix(comma + 1);
    if (trimmed(text).empty()) {
      return std::nullopt;  // "1, 2,"
    }
  }
  return values;
}

bool in_range(const OptionField& field, double value) {
  return value >= field.min && value <= field.max;  // false for NaN
}

bool in_range(const OptionField& field, const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(),
                     [&](double value) { return std::isfinite(value) && in_range(field, value); });
}

std::string quoted(const std::string& text) {
  constexpr std::size_t kShown = 60;
  std::size_t end = std::min(text.size(), kShown);
  while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) {
    --end;  // no character is cut in two
  }
  return "'" + printable(text.substr(0, end)) + (text.size() > end ? "..." : "") + "'";
}

std::string json_string(const std::string& text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20) {
      out += "\\u00";
      out += kDigits[byte >> 4];
      out += kDigits[byte & 15];
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string list_text(const std::vector<double>& values, std::string_view separator) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); ++i) {
    text += (i > 0 ? std::string(separator) : "") + number_text(values[i]);
  }
  return text + "]";
}

std::string join(const std::vector<std::string>& words, std::string_view separator) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += (i > 0 ? std::string(separator) : "") + words[i];
  }
  return text;
}

/// A bound as one writes it: 1000000 rather than 1e+06.
std::string bound_text(double value) {
  constexpr double kWritten = 1e10;
  return std::abs(value) < kWritten && value == std::floor(value)
             ? number_text(saturating_cast<std::int64_t>(value))
             : number_text(value);
}

/// "in [0, 1]", ">= 0", "<= 1" or "".
std::string bounds(const OptionField& field) {
  const bool low = std::isfinite(field.min);
  const bool high = std::isfinite(field.max);
  if (low && high) {
    return " in [" + bound_text(field.min) + ", " + bound_text(field.max) + "]";
  }
  return low ? " >= " + bound_text(field.min) : high ? " <= " + bound_text(field.max) : "";
}

/// Text of a choice: each of them is one word.
std::vector<std::string> words_of(const std::vector<std::string>& choices) {
  std::vector<std::string> words = choices;
  std::erase(words, "");
  return words;
}

std::string choice_problem(const OptionField& field, const std::string& text) {
  return field.name + " cannot be " + quoted(text) + ": it takes " +
         join(words_of(field.choices), ", ") + did_you_mean(text, field.choices);
}

std::string range_problem(const OptionField& field, const std::string& text) {
  const std::string takes = std::holds_alternative<bool*>(field.target) ? "true or false"
                            : std::holds_alternative<int*>(field.target) ||
                                    std::holds_alternative<std::int64_t*>(field.target)
                                ? "an " + option_range(field)
                                : "a " + option_range(field);
  return field.name + " cannot be " + quoted(text) + ": it takes " + takes +
         (field.unit.empty() ? "" : " (" + field.unit + ")");
}

template <class Integer>
std::string set_integer(const OptionField& field, Integer* target, const std::string& text) {
  const auto value = number_of<Integer>(trimmed(text));
  if (!value || !in_range(field, static_cast<double>(*value))) {
    return range_problem(field, text);
  }
  *target = *value;
  return "";
}

std::string set_field(const OptionField& field, const std::string& text) {
  return std::visit(
      Overloaded{[&](bool* target) {
                   const std::string_view word = trimmed(text);
                   if (word != "true" && word != "false") {
                     return range_problem(field, text);
                   }
                   *target = word == "true";
                   return std::string();
                 },
                 [&](int* target) { return set_integer(field, target, text); },
                 [&](std::int64_t* target) { return set_integer(field, target, text); },
                 [&](double* target) {
                   const auto value = number_of<double>(trimmed(text));
                   if (!value || !in_range(field, *value)) {
                     return range_problem(field, text);
                   }
                   *target = *value;
                   return std::string();
                 },
                 [&](std::string* target) {
                   if (!field.choices.empty() &&
                       std::find(field.choices.begin(), field.choices.end(), text) ==
                           field.choices.end()) {
                     return choice_problem(field, text);
                   }
                   if (!is_printable_utf8(text)) {
                     return field.name + " cannot be " + quoted(text) +
                            ": it takes UTF-8 text without control characters";
                   }
                   *target = text;
                   return std::string();
                 },
                 [&](std::vector<double>* target) {
                   const auto values = numbers_of(text);
                   if (trimmed(text).empty()) {
                     return range_problem(field, text) + ", [] for none";
                   }
                   if (!values || !in_range(field, *values)) {
                     return range_problem(field, text);
                   }
                   *target = *values;
                   return std::string();
                 },
                 [&](const OptionEnum& target) {
                   const auto found = std::find(field.choices.begin(), field.choices.end(), text);
                   if (found == field.choices.end()) {
                     return choice_problem(field, text);
                   }
                   target.set(static_cast<std::size_t>(found - field.choices.begin()));
                   return std::string();
                 }},
      field.target);
}

std::string enum_text(const OptionField& field, const OptionEnum& target) {
  const std::size_t at = target.get();
  return at < field.choices.size() ? field.choices[at] : "?";
}

std::string without_bars(const std::string& text) {
  std::string out;
  for (const char c : text) {
    out += c == '|' ? "\\|" : std::string(1, c);
  }
  return out;
}

}  // namespace

OptionTable& OptionTable::append(OptionField field) {
  ATELIER_CHECK(is_option_name(field.name), "'" + field.name + "' is no option name");
  ATELIER_CHECK(!field.help.empty(), field.name + " has no help");
  ATELIER_CHECK(field.min <= field.max, field.name + " has an empty range");
  ATELIER_CHECK(std::none_of(fields.begin(), fields.end(),
                             [&](const OptionField& other) { return other.name == field.name; }),
                field.name + " is there twice");
  // One form for all, whoever wrote it.
  if (field.help.front() >= 'a' && field.help.front() <= 'z') {
    field.help.front() = static_cast<char>(field.help.front() - 'a' + 'A');
  }
  if (field.help.size() > 1 && field.help.back() == '.') {
    field.help.pop_back();
  }
  fields.push_back(std::move(field));
  return *this;
}

OptionTable& OptionTable::add(std::string name, bool& target, std::string help) {
  return append({.name = std::move(name), .help = std::move(help), .unit = "", .target = &target});
}

OptionTable& OptionTable::add_ranged(std::string name, OptionTarget target, double min, double max,
                                     std::string unit, std::string help) {
  return append({.name = std::move(name),
                 .help = std::move(help),
                 .unit = std::move(unit),
                 .target = std::move(target),
                 .min = min,
                 .max = max});
}

OptionTable& OptionTable::add_chosen(std::string name, OptionTarget target,
                                     std::vector<std::string> choices, std::string help) {
  return append({.name = std::move(name),
                 .help = std::move(help),
                 .unit = "",
                 .target = std::move(target),
                 .choices = std::move(choices)});
}

OptionTable& OptionTable::add(std::string name, int& target, double min, double max,
                              std::string unit, std::string help) {
  return add_ranged(std::move(name), &target, min, max, std::move(unit), std::move(help));
}

OptionTable& OptionTable::add(std::string name, std::int64_t& target, double min, double max,
                              std::string unit, std::string help) {
  return add_ranged(std::move(name), &target, min, max, std::move(unit), std::move(help));
}

OptionTable& OptionTable::add(std::string name, double& target, double min, double max,
                              std::string unit, std::string help) {
  return add_ranged(std::move(name), &target, min, max, std::move(unit), std::move(help));
}

OptionTable& OptionTable::add(std::string name, std::vector<double>& target, double min, double max,
                              std::string unit, std::string help) {
  return add_ranged(std::move(name), &target, min, max, std::move(unit), std::move(help));
}

OptionTable& OptionTable::add(std::string name, std::string& target,
                              std::vector<std::string> choices, std::string help) {
  return add_chosen(std::move(name), &target, std::move(choices), std::move(help));
}

OptionTable& OptionTable::add_enum(std::string name, OptionEnum target,
                                   std::vector<std::string> choices, std::string help) {
  ATELIER_CHECK(!choices.empty(), name + " has no choices");
  return add_chosen(std::move(name), std::move(target), std::move(choices), std::move(help));
}

OptionTable& OptionTable::add(const std::string& name, const OptionTable& nested) {
  for (OptionField field : nested.fields) {
    field.name = name + "." + field.name;
    append(std::move(field));
  }
  return *this;
}

OptionTable& OptionTable::add(const OptionTable& others) {
  for (const OptionField& field : others.fields) {
    append(field);
  }
  return *this;
}

OptionTable& OptionTable::not_keyed() {
  ATELIER_CHECK(!fields.empty(), "not_keyed before any add");
  fields.back().keyed = false;
  return *this;
}

std::string set_option(OptionTable& table, const std::string& name, const std::string& text,
                       const std::string& source) {
  const auto field = std::find_if(table.fields.begin(), table.fields.end(),
                                  [&](const OptionField& f) { return f.name == name; });
  if (field == table.fields.end()) {
    std::vector<std::string> names;
    for (const OptionField& known : table.fields) {
      names.push_back(known.name);
    }
    if (const std::string now = renamed_option(name, names); !now.empty()) {
      table.notices.push_back((source == "flag" ? "" : source + ": ") + name + " is now " + now);
      return set_option(table, now, text, source);
    }
    const std::string near = did_you_mean(name, names);
    return "there is no option " + quoted(name) +
           (near.empty() ? "; 'atelier options' lists them" : near);
  }
  if (text.size() > static_cast<std::size_t>(Limits{}.text_string_bytes)) {
    return field->name + " is " + std::to_string(text.size()) + " bytes long: at most " +
           std::to_string(Limits{}.text_string_bytes) + " are read";
  }
  if (const std::string now = renamed_choice(text, field->choices); !now.empty()) {
    table.notices.push_back((source == "flag" ? "" : source + ": ") + "the value '" + text +
                            "' of " + field->name + " is now '" + now + "'");
    return set_option(table, field->name, now, source);
  }
  std::string problem = set_field(*field, text);
  if (problem.empty()) {
    field->source = source;
  }
  return problem;
}

std::string option_text(const OptionField& field) {
  return std::visit(
      Overloaded{[](const bool* value) { return std::string(*value ? "true" : "false"); },
                 [](const int* value) { return number_text(*value); },
                 [](const std::int64_t* value) { return number_text(*value); },
                 [](const double* value) { return number_text(*value); },
                 [](const std::string* value) { return *value; },
                 [](const std::vector<double>* value) { return list_text(*value, ", "); },
                 [&](const OptionEnum& value) { return enum_text(field, value); }},
      field.target);
}

std::string option_json(const OptionField& field) {
  if (const auto* const* number = std::get_if<double*>(&field.target)) {
    ATELIER_CHECK(std::isfinite(**number), field.name + " is not finite");
  }
  if (const auto* const* list = std::get_if<std::vector<double>*>(&field.target)) {
    ATELIER_CHECK(std::all_of((*list)->begin(), (*list)->end(),
                              [](double value) { return std::isfinite(value); }),
                  field.name + " is not finite");
    return list_text(**list, ",");
  }
  const bool is_text = std::holds_alternative<std::string*>(field.target) ||
                       std::holds_alternative<OptionEnum>(field.target);
  return is_text ? json_string(option_text(field)) : option_text(field);
}

std::string option_range(const OptionField& field) {
  return std::visit(
      Overloaded{[](const bool*) { return std::string("true|false"); },
                 [&](const int*) { return "integer" + bounds(field); },
                 [&](const std::int64_t*) { return "integer" + bounds(field); },
                 [&](const double*) { return "number" + bounds(field); },
                 [&](const std::string*) {
                   return field.choices.empty() ? "text" : join(words_of(field.choices), "|");
                 },
                 [&](const std::vector<double>*) { return "list of numbers" + bounds(field); },
                 [&](const OptionEnum&) { return join(field.choices, "|"); }},
      field.target);
}

std::string canonical_json(const OptionTable& table) {
  std::map<std::string, std::string> sorted;
  for (const OptionField& field : table.fields) {
    if (field.keyed) {
      sorted[field.name] = option_json(field);
    }
  }
  std::string text = "{";
  for (const auto& [name, value] : sorted) {
    text += (text.size() > 1 ? "," : "") + json_string(name) + ":" + value;
  }
  return text + "}";
}

std::vector<std::string> check_options(const OptionTable& table) {
  std::vector<std::string> problems;
  for (const OptionField& field : table.fields) {
    const std::string problem = std::visit(
        Overloaded{
            [](const bool*) { return std::string(); },
            [&](const int* value) {
              return in_range(field, *value) ? "" : range_problem(field, number_text(*value));
            },
            [&](const std::int64_t* value) {
              return in_range(field, static_cast<double>(*value))
                         ? ""
                         : range_problem(field, number_text(*value));
            },
            [&](const double* value) {
              return std::isfinite(*value) && in_range(field, *value)
                         ? ""
                         : range_problem(field, number_text(*value));
            },
            [&](const std::string* value) {
              const bool known = field.choices.empty() ||
                                 std::find(field.choices.begin(), field.choices.end(), *value) !=
                                     field.choices.end();
              return known ? "" : choice_problem(field, *value);
            },
            [&](const std::vector<double>* value) {
              return in_range(field, *value) ? "" : range_problem(field, list_text(*value, ", "));
            },
            [&](const OptionEnum& value) {
              return value.get() < field.choices.size() ? "" : choice_problem(field, "?");
            }},
        field.target);
    if (!problem.empty()) {
      problems.push_back(problem);
    }
  }
  return problems;
}

std::string options_markdown(const OptionTable& table) {
  std::string text = "| option | default | takes | unit | what it is |\n|---|---|---|---|---|\n";
  for (const OptionField& field : table.fields) {
    const std::string value = option_text(field);
    text += "| `" + field.name + "` | " + (value.empty() ? "" : "`" + without_bars(value) + "`") +
            " | " + without_bars(option_range(field)) + " | " + without_bars(field.unit) + " | " +
            without_bars(field.help) + (field.keyed ? "" : " (not part of the key)") + " |\n";
  }
  return text;
}

std::string options_help(const OptionTable& table) {
  std::string text;
  for (const OptionField& field : table.fields) {
    const std::string value = option_text(field);
    text += "  --" + field.name + " <" + option_range(field) + ">" +
            (field.unit.empty() ? "" : " " + field.unit) + "\n      " + field.help + " [" +
            (value.empty() ? "none" : value) + "]\n";
  }
  return text;
}

}  // namespace atelier
