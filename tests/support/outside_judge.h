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

/// Lines of a word and numbers; with a mark, those that begin with it alone.
inline Judgement judgement_of(const std::string& text, const std::string& mark = "") {
  Judgement found;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (!mark.empty() && word != mark) {
      continue;
    }
    if (!mark.empty()) {
      words >> word;
    }
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

inline bool has_program(const std::string& name) {
  return run_child({"sh", "-c", "command -v " + name}).exit_code == 0;
}

#define ATELIER_NEEDS_PROGRAM(name)                                 \
  if (!fixtures::has_program(name)) {                               \
    GTEST_SKIP() << "no program " name " (scripts/setup --judges)"; \
  }

/// Runs tests/judges/blender_judge.py inside of Blender. Throws std::runtime_error if it fails.
inline Judgement judged_by_blender(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {
      "blender", "--background", "--python-exit-code",
      "1",       "--python",     (source_directory() / "tests/judges/blender_judge.py").string(),
      "--"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  const ChildResult result = run_child(command);
  if (result.exit_code != 0) {
    throw std::runtime_error("blender: " + result.out + result.err);
  }
  return judgement_of(result.out, "judged");
}

}  // namespace atelier::fixtures
