#pragma once

#include <string>

namespace atelier {

/// "3 s", "12 min", "4.1 h": a duration for people.
std::string duration_text(double seconds);

/// "12 B", "3.4 MB".
std::string bytes_text(double bytes);

}  // namespace atelier
