#include "core/io/plain_text.h"

#include <algorithm>

#include "core/error.h"
#include "core/io/text_scanner.h"

namespace atelier {

std::string line_at(std::string_view text, std::size_t at) {
  const std::string_view before = text.substr(0, at);
  return "line " + std::to_string(1 + std::count(before.begin(), before.end(), '\n'));
}

void check_plain_text(std::string_view text, const std::string& file) {
  const auto control = std::find_if(text.begin(), text.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < 32 && c != '\t' && c != '\n' && c != '\r') || byte == 127;
  });
  if (control != text.end()) {
    throw DataError(
        file, line_at(text, static_cast<std::size_t>(control - text.begin())),
        "a control character, byte " + std::to_string(static_cast<unsigned char>(*control)),
        "text");
  }
}

std::string beginning_of(std::string_view text) {
  return text.empty() ? "an empty file" : in_quotes(text.substr(0, 20));
}

std::string_view trimmed_text(std::string_view text) {
  constexpr const char* kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  return first == std::string_view::npos
             ? std::string_view()
             : text.substr(first, text.find_last_not_of(kBlank) + 1 - first);
}

}  // namespace atelier
