#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

namespace atelier {

/// The command line or an options file is wrong. The program exits with 2.
struct UsageError : std::runtime_error {
  explicit UsageError(const std::string& problem) : UsageError(std::vector{problem}) {}

  /// Several problems, a line each: line ends inside of one are its text's, and become spaces.
  explicit UsageError(const std::vector<std::string>& problems)
      : std::runtime_error(lines(problems)) {}

 private:
  static std::string lines(const std::vector<std::string>& problems) {
    std::string all;
    for (std::string problem : problems) {
      std::replace(problem.begin(), problem.end(), '\n', ' ');
      all += (all.empty() ? "" : "\n") + problem;
    }
    return all;
  }
};

}  // namespace atelier
