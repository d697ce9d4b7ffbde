#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// The parts of a text between separators, which are left out. A separator at the end begins no
/// further part, as a line end does at the end of a file; an empty text has no part.
std::vector<std::string> split_text(std::string_view text, char separator);

}  // namespace atelier
