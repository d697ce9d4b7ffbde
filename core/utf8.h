#pragma once

#include <cstddef>
#include <string_view>

namespace atelier {

/// Where the first bytes stand that are no well-formed UTF-8 (Unicode 15, table 3-7: no overlong
/// forms, no surrogates, nothing above U+10FFFF); npos if all are.
std::size_t find_malformed_utf8(std::string_view text);

/// True if the bytes are well-formed UTF-8 without what a terminal obeys: control characters
/// (U+0000 to U+001F, U+007F to U+009F) and those that turn the direction of the text around them
/// (U+202A to U+202E, U+2066 to U+2069). Characters allowed in names and option texts.
bool is_printable_utf8(std::string_view text);

}  // namespace atelier
