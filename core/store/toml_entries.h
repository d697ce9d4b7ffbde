#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// One value of a TOML text.
struct TomlEntry {
  enum class Kind { Boolean, Number, Text, Numbers, Table, Other };

  std::string name;  ///< keys joined by dots; tables in an array by number: "consent.0.who"
  Kind kind = Kind::Other;
  std::string text;  ///< "true", "0.5", "wool", "[1, 2]", "2030-12-31"; of Other as JSON has it
  std::int64_t line = 0;  ///< from 1
};

/// Every value of a TOML 1.0 text, tables flattened; one that has nothing in it is a Table. Dates
/// and times are Text, empty arrays Numbers, mixed arrays Other. Throws DataError as `parse_toml`
/// does.
std::vector<TomlEntry> read_toml_entries(std::string_view text, const std::string& file);

}  // namespace atelier
