#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace atelier {

/// The requested use is not covered by consent. The program exits with 1.
struct ConsentRefused : std::runtime_error {
  /// @param reasons  a sentence each, with what would change it
  explicit ConsentRefused(const std::vector<std::string>& reasons)
      : std::runtime_error(lines(reasons)) {}

 private:
  static std::string lines(const std::vector<std::string>& reasons) {
    std::string all;
    for (const std::string& reason : reasons) {
      all += (all.empty() ? "" : "\n") + reason;
    }
    return all;
  }
};

}  // namespace atelier
