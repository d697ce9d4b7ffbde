// Documents say which test shows what they promise: there is such a test.
#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/places.h"
#include "tests/support/read_text.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;

std::set<std::string> matches(const fs::path& folder, const std::set<std::string>& endings,
                              const std::regex& pattern, const std::string& format) {
  std::set<std::string> found;
  for (const auto& entry : fs::recursive_directory_iterator(source_directory() / folder)) {
    if (!endings.contains(entry.path().extension().string())) {
      continue;
    }
    const std::string text = read_text(entry.path());
    for (std::sregex_iterator at(text.begin(), text.end(), pattern), end; at != end; ++at) {
      found.insert(at->format(format));
    }
  }
  return found;
}

TEST(NamedTests, EveryOneOfADocument_IsThere) {
  const std::set<std::string> tests =
      matches("tests", {".cpp", ".h", ".cu"},
              std::regex(R"(\bTEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\s*\))"), "$1.$2");
  // `Suite.Name_*` and `Suite.*`, those of parameters with "/parameter" behind.
  const std::set<std::string> named = matches(
      "docs", {".md"}, std::regex(R"(`([A-Z]\w+\.(?=[\w*]*[_*])[A-Z*][\w*]*)(?:/\w+)?`)"), "$1");
  EXPECT_GT(named.size(), 100U);
  for (const std::string& name : named) {
    std::string pattern;
    for (const char c : name) {
      pattern += c == '*' ? std::string(".*") : c == '.' ? std::string("\\.") : std::string(1, c);
    }
    const std::regex wanted(pattern);
    EXPECT_TRUE(std::any_of(tests.begin(), tests.end(), [&](const std::string& test) {
      return std::regex_match(test, wanted);
    })) << name;
  }
}

}  // namespace
}  // namespace atelier::fixtures
