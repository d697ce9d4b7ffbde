#pragma once

#include <string>
#include <string_view>

#include <toml++/toml.h>

namespace atelier {

/// Parses TOML 1.0 text within the ceilings of core/limits.h (size, depth, strings). Throws
/// DataError with line and column. Heavy: include it in .cpp files alone.
toml::table parse_toml_text(std::string_view text, const std::string& file);

}  // namespace atelier
