#pragma once

#include <charconv>
#include <string>

namespace atelier {

/// Appends the shortest text that reads back to the same bits; no locale.
template <class Number>
void append_number(std::string& text, Number value) {
  char digits[32];
  const auto [end, error] = std::to_chars(digits, digits + sizeof(digits), value);
  text.append(digits, end);
}

/// That text alone.
template <class Number>
std::string number_text(Number value) {
  std::string text;
  append_number(text, value);
  return text;
}

}  // namespace atelier
