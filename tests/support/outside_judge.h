#pragma once

#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/child_process.h"
#include "tests/support/places.h"

namespace atelier::fixtures {

/// Whether the npm package of an outside judge is there (scripts/setup --judges).
inline bool has_judge(const std::string& package) {
  return std::filesystem::exists(source_directory() / "tests/judges/node_modules" / package) &&
         run_child({"sh", "-c", "command -v node"}).exit_code == 0;
}

#define ATELIER_NEEDS_JUDGE(package)                                                  \
  if (!fixtures::has_judge(package)) {                                                \
    GTEST_SKIP() << "no npm package " package " or no node (scripts/setup --judges)"; \
  }

/// What a judge found: numbers by the word that its line begins with.
using Judgement = std::map<std::string, std::vector<double>>;

/// Lines of a word and numbers.
inline Judgement judgement_of(const std::string& text) {
  Judgement found;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    for (std::string number; words >> number;) {
      found[word].push_back(std::stod(number));
    }
  }
  return found;
}

/// Runs a script of tests/judges. Throws std::runtime_error, with what it says, if it fails.
inline Judgement judged(const std::string& script, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(),
                   {"node", (source_directory() / "tests/judges" / script).string()});
  const ChildResult result = run_child(arguments);
  if (result.exit_code != 0) {
    throw std::runtime_error(script + ": " + result.out + result.err);
  }
  return judgement_of(result.out);
}

}  // namespace atelier::fixtures
