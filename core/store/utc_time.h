#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace atelier {

/// "2026-11-21T10:40:00Z" of seconds since 1970.
std::string utc_text(double seconds);

/// Reads what `utc_text` writes, to the second; nothing for anything else.
std::optional<double> seconds_of_utc(std::string_view text);

}  // namespace atelier
