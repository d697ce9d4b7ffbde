#pragma once

#include <cstdio>
#include <string>

namespace atelier {

/// Text of a finding, formatted as by printf; at most 255 bytes.
template <class... Values>
std::string sentence(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

}  // namespace atelier
