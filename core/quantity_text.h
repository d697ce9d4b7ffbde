#pragma once

#include <string>

namespace atelier {

/// "3 s", "12 min", "4.1 h": a duration for people.
std::string duration_text(double seconds);

/// "12 B", "3.4 MB".
std::string bytes_text(double bytes);

/// A number as messages say it, by its significant digits, so that only 0 is said as "0": "33.3",
/// "0.00042", "1243", "1e-12".
std::string short_number(double value, int digits = 4);

/// A share as whole percents, which are never 0 of some nor 100 of less than all: "12%", "0.03%",
/// "over 99%".
std::string percent(double share);

}  // namespace atelier
