#include "core/quantity_text.h"

#include <array>
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

}  // namespace atelier
