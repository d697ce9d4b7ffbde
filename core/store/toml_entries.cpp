#include "core/store/toml_entries.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "core/io/toml.h"

namespace atelier {
namespace {

using Kind = TomlEntry::Kind;

/// "[1, 2.5]"
std::string list_text(const nlohmann::json& numbers) {
  std::string text = "[";
  for (const nlohmann::json& number : numbers) {
    text += (text.size() > 1 ? ", " : "") + number.dump();
  }
  return text + "]";
}

bool all_of(const nlohmann::json& array, bool (nlohmann::json::*is)() const noexcept) {
  return std::all_of(array.begin(), array.end(),
                     [is](const nlohmann::json& item) { return (item.*is)(); });
}

void flatten(const nlohmann::json& value, const std::string& name,
             const std::map<std::string, int>& lines, std::vector<TomlEntry>& entries) {
  const auto named = [&](const std::string& word) {
    return name.empty() ? word : name + "." + word;
  };
  if (value.is_object() && (!value.empty() || name.empty())) {
    for (const auto& item : value.items()) {
      flatten(item.value(), named(item.key()), lines, entries);
    }
    return;
  }
  if (value.is_array() && !value.empty() && all_of(value, &nlohmann::json::is_object)) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      flatten(value[i], named(std::to_string(i)), lines, entries);
    }
    return;
  }
  TomlEntry entry;
  entry.name = name;
  const auto line = lines.find(name);
  entry.line = line == lines.end() ? 1 : line->second;
  if (value.is_object()) {
    entry.kind = Kind::Table;
  } else if (value.is_boolean()) {
    entry.kind = Kind::Boolean;
    entry.text = value.dump();
  } else if (value.is_number()) {
    entry.kind = Kind::Number;
    entry.text = value.dump();
  } else if (value.is_string()) {
    entry.kind = Kind::Text;
    entry.text = value.get<std::string>();
  } else if (value.is_array() && all_of(value, &nlohmann::json::is_number)) {
    entry.kind = Kind::Numbers;
    entry.text = list_text(value);
  } else {
    entry.text = value.dump();
  }
  entries.push_back(std::move(entry));
}

}  // namespace

std::vector<TomlEntry> read_toml_entries(std::string_view text, const std::string& file) {
  const nlohmann::json value = parse_toml(text, file);
  std::vector<TomlEntry> entries;
  flatten(value, "", toml_lines(text, file), entries);
  std::stable_sort(entries.begin(), entries.end(),
                   [](const TomlEntry& a, const TomlEntry& b) { return a.line < b.line; });
  return entries;
}

}  // namespace atelier
