#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

#include "core/io/text_scanner.h"

namespace atelier::fuzz {

/// Two files in one input: what stands before and behind the first line "===".
inline std::pair<std::string_view, std::string_view> two_texts(std::span<const std::byte> bytes) {
  const std::string_view text = as_text(bytes);
  constexpr std::string_view kBetween = "\n===\n";
  const std::size_t at = text.find(kBetween);
  return at == std::string_view::npos
             ? std::pair{text, std::string_view()}
             : std::pair{text.substr(0, at + 1), text.substr(at + kBetween.size())};
}

}  // namespace atelier::fuzz
