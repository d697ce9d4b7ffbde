#include "core/store/options_file.h"

#include <array>
#include <charconv>
#include <optional>

#include "core/store/toml_text.h"

namespace atelier {
namespace {

std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

/// The value as `set_option` reads it; nothing for dates, tables and arrays of other things.
std::optional<std::string> text_of(const toml::node& node) {
  if (const auto* flag = node.as_boolean()) {
    return flag->get() ? "true" : "false";
  }
  if (const auto* integer = node.as_integer()) {
    return std::to_string(integer->get());
  }
  if (const auto* number = node.as_floating_point()) {
    return number_text(number->get());
  }
  if (const auto* text = node.as_string()) {
    return text->get();
  }
  if (const auto* array = node.as_array()) {
    std::string list = "[";
    for (const toml::node& item : *array) {
      if (!item.is_number()) {
        return std::nullopt;
      }
      list += (list.size() > 1 ? ", " : "") + text_of(item).value_or("");
    }
    return list + "]";
  }
  return std::nullopt;
}

void set_from(OptionTable& options, const toml::table& table, const std::string& prefix,
              const std::string& file, std::vector<std::string>& problems) {
  for (const auto& [key, node] : table) {
    const std::string name = prefix + std::string(key.str());
    if (const toml::table* nested = node.as_table()) {
      set_from(options, *nested, name + ".", file, problems);
      continue;
    }
    const std::string place = file + ":" + std::to_string(node.source().begin.line);
    const std::optional<std::string> text = text_of(node);
    const std::string problem =
        text ? set_option(options, name, *text, place)
             : name + " cannot be a date, a time or a list of anything but numbers";
    if (!problem.empty()) {
      problems.push_back(place + ": " + problem);
    }
  }
}

}  // namespace

std::vector<std::string> set_options_from_toml(OptionTable& table, std::string_view text,
                                               const std::string& file) {
  std::vector<std::string> problems;
  set_from(table, parse_toml_text(text, file), "", file, problems);
  return problems;
}

}  // namespace atelier
