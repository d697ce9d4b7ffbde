#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace atelier::fixtures {

/// "--flag value" pairs that a test sets unless it says otherwise: those of `usual` that `more`
/// does not name, then `more`. The program takes each option once.
inline std::vector<std::string> with_usual(const std::vector<std::string>& usual,
                                           const std::vector<std::string>& more) {
  const auto dashed = [](std::string flag) {
    std::replace(flag.begin(), flag.end(), '_', '-');
    return flag;
  };
  std::vector<std::string> all;
  for (std::size_t i = 0; i + 1 < usual.size(); i += 2) {
    if (std::none_of(more.begin(), more.end(),
                     [&](const std::string& word) { return dashed(word) == dashed(usual[i]); })) {
      all.insert(all.end(), {usual[i], usual[i + 1]});
    }
  }
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

}  // namespace atelier::fixtures
