#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// One value of a TOML text.
struct TomlEntry {
  enum class Kind { Boolean, Number, Text, Numbers, Date, Other };

  std::string name;  ///< keys joined by dots; tables in an array by number: "consent.0.who"
  Kind kind = Kind::Other;
  std::string text;       ///< "true", "0.5", "wool", "[1, 2]", "2030-12-31"; "" for Other
  std::int64_t line = 0;  ///< from 1
};

/// Every value of a TOML 1.0 text, tables flattened. Empty arrays are Numbers; times and mixed
/// arrays are Other. Throws DataError, with line and column, for what is no TOML and beyond the
/// ceilings of core/limits.h (size, depth, strings).
std::vector<TomlEntry> read_toml_entries(std::string_view text, const std::string& file);

}  // namespace atelier
