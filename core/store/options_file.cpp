#include "core/store/options_file.h"

#include "core/store/toml_entries.h"

namespace atelier {

std::vector<std::string> set_options_from_toml(OptionTable& table, std::string_view text,
                                               const std::string& file) {
  std::vector<std::string> problems;
  for (const TomlEntry& entry : read_toml_entries(text, file)) {
    const std::string place = file + ":" + std::to_string(entry.line);
    const std::string problem = entry.kind != TomlEntry::Kind::Other
                                    ? set_option(table, entry.name, entry.text, place)
                                    : entry.name + " cannot be a list of anything but numbers";
    if (!problem.empty()) {
      problems.push_back(place + ": " + problem);
    }
  }
  return problems;
}

}  // namespace atelier
