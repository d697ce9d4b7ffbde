#include "core/store/options_file.h"

#include <algorithm>
#include <cctype>

#include "core/nearest_name.h"
#include "core/store/toml_entries.h"

namespace atelier {
namespace {

/// Why an entry cannot be an option's value, whatever the option; "" if it may be one.
std::string entry_problem(const OptionTable& table, const TomlEntry& entry) {
  for (std::size_t begin = 0; begin < entry.name.size();) {
    const std::size_t end = std::min(entry.name.find('.', begin), entry.name.size());
    if (begin > 0 && std::all_of(entry.name.begin() + static_cast<std::ptrdiff_t>(begin),
                                 entry.name.begin() + static_cast<std::ptrdiff_t>(end),
                                 [](unsigned char c) { return std::isdigit(c) != 0; })) {
      return entry.name.substr(0, begin - 1) + " cannot be a list of tables";
    }
    begin = end + 1;
  }
  if (entry.kind == TomlEntry::Kind::Other) {
    return entry.name + " cannot be a list of anything but numbers";
  }
  if (entry.kind == TomlEntry::Kind::Table) {
    for (const OptionField& field : table.fields) {
      if (field.name == entry.name) {
        return entry.name + " cannot be a table";
      }
    }
    std::vector<std::string> tables;
    for (const OptionField& field : table.fields) {
      for (std::size_t dot = field.name.find('.'); dot != std::string::npos;
           dot = field.name.find('.', dot + 1)) {
        tables.push_back(field.name.substr(0, dot));
      }
    }
    return "there is no option whose name begins with '" + entry.name.substr(0, 60) + ".'" +
           did_you_mean(entry.name, tables);
  }
  return "";
}

/// An empty table of options that exist sets none of them.
bool sets_nothing(const OptionTable& table, const TomlEntry& entry) {
  const std::string begin = entry.name + ".";
  return entry.kind == TomlEntry::Kind::Table &&
         std::any_of(table.fields.begin(), table.fields.end(),
                     [&](const OptionField& field) { return field.name.starts_with(begin); });
}

}  // namespace

std::vector<std::string> set_options_from_toml(OptionTable& table, std::string_view text,
                                               const std::string& file) {
  std::vector<std::string> problems;
  for (const TomlEntry& entry : read_toml_entries(text, file)) {
    const std::string place = file + ":" + std::to_string(entry.line);
    if (sets_nothing(table, entry)) {
      continue;
    }
    const std::string of_entry = entry_problem(table, entry);
    const std::string problem =
        of_entry.empty() ? set_option(table, entry.name, entry.text, place) : of_entry;
    if (!problem.empty()) {
      problems.emplace_back(place).append(": ").append(problem);
    }
  }
  return problems;
}

}  // namespace atelier
