#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace atelier {

/// "line 7": where the byte `at` of a text stands, from 1.
std::string line_at(std::string_view text, std::size_t at);

/// Throws DataError, with the line, for control characters other than tab and line ends, which no
/// text has: a file of another kind under this name, or a damaged one.
void check_plain_text(std::string_view text, const std::string& file);

/// The beginning of a text, for errors: in quotes, or "an empty file".
std::string beginning_of(std::string_view text);

/// Without blanks and line ends at both ends.
std::string_view trimmed_text(std::string_view text);

}  // namespace atelier
