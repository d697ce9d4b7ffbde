#pragma once

#include <cstdint>
#include <string>

namespace atelier {

/// The text as a terminal may get it: names inside files, and file names, are their makers', and
/// what a terminal would obey is shown as "?". Line ends stay only where `lines` is true.
std::string printable(const std::string& text, bool lines = false);

/// "1 file", "2 files".
std::string counted(std::int64_t count, const std::string& noun);

}  // namespace atelier
