#include "core/quantity_text.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace atelier {
namespace {

std::string quantity(const char* format, double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

}  // namespace

std::string duration_text(double seconds) {
  return seconds < 10      ? quantity("%.2g s", seconds)
         : seconds < 120   ? quantity("%.0f s", seconds)
         : seconds < 7200  ? quantity("%.0f min", seconds / 60)
         : seconds < 86400 ? quantity("%.1f h", seconds / 3600)
                           : quantity("%.1f days", seconds / 86400);
}

std::string bytes_text(double bytes) {
  return bytes < 1e3   ? quantity("%.0f B", bytes)
         : bytes < 1e6 ? quantity("%.1f kB", bytes / 1e3)
         : bytes < 1e9 ? quantity("%.1f MB", bytes / 1e6)
                       : quantity("%.1f GB", bytes / 1e9);
}

std::string short_number(double value, int digits) {
  std::array<char, 40> text{};
  // "%g" would say 12345 as 1.234e+04.
  const bool whole = std::abs(value) >= std::pow(10, digits) && std::abs(value) < 1e7;
  if (whole) {
    std::snprintf(text.data(), text.size(), "%.0f", value);
  } else {
    std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  }
  return text.data();
}

std::string percent(double share) {
  const double parts = 100 * share;
  return std::abs(parts) < 0.5         ? short_number(parts, 1) + "%"
         : parts > 99.5 && parts < 100 ? "over 99%"
                                       : quantity("%.0f%%", parts);
}

}  // namespace atelier
