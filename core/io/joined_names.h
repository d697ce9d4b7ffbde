#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace atelier {

/// The names in a text that joins them by +, as --garment has them: "tee+trousers". One where there
/// is no +; empty ones stay, for the caller to refuse.
inline std::vector<std::string> joined_names(const std::string& text) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('+', begin), text.size());
    names.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return names;
}

}  // namespace atelier
