// Computed numbers become integers through core/saturating_cast.h alone: a plain cast of one that
// the integer cannot hold is undefined behaviour, and what is computed from a file can be anything.
#include <algorithm>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/build/dependency_law.h"
#include "tests/support/places.h"

namespace atelier::fixtures {
namespace {

/// Inner loops, most of them of kernels for the GPU as well, and why their numbers fit.
const std::map<std::string, const char*> kInside = {
    {"core/raster_math.h", "corners are clipped to the guard band, 2^17 pixels"},
    {"simulation/contact/collision_response_math.h", "limited to what fits in the line before"},
    {"appearance/occlusion_math.h", "harmonics of unit vectors are below 2"},
};

/// The casts in a source that round and do not go through the checked function.
std::vector<std::string> unchecked_casts(const LawSource& source) {
  static const std::regex pattern(
      R"(l?l(?:round|rint)\(|static_cast<(?:std::)?(?:u?int(?:\d+_t)?|Index|long|unsigned|size_t|ptrdiff_t)>\(\s*std::(?:floor|ceil|round|rint|trunc)\()");
  const std::string& text = source.text;
  std::vector<std::string> found;
  const auto look_at = [&](std::size_t at) {
    constexpr std::size_t kLongest = 120;  // the expression itself is slow on whole sources
    const std::string part = text.substr(at, kLongest);
    std::smatch match;
    if (std::regex_search(part, match, pattern, std::regex_constants::match_continuous)) {
      const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<long>(at), '\n');
      found.push_back(source.path + ":" + std::to_string(line) + ": " + match.str());
    }
  };
  for (const std::string begin : {"static_cast<", "lround(", "lrint("}) {
    for (std::size_t at = text.find(begin); at != std::string::npos;
         at = text.find(begin, at + 1)) {
      look_at(at);
    }
  }
  return found;
}

TEST(CastLaw, SourcesOfTheProject_RoundToIntegersThroughTheCheckedFunction) {
  std::vector<std::string> found;
  for (const LawSource& source : read_law_sources(source_directory())) {
    if (!kInside.contains(source.path)) {
      for (std::string& cast : unchecked_casts(source)) {
        found.push_back(std::move(cast));
      }
    }
  }
  EXPECT_THAT(found, ::testing::IsEmpty());
}

TEST(CastLaw, PlantedCasts_AreFound) {
  const auto finds = [](const std::string& text) {
    return unchecked_casts({"core/a.cpp", text}).size();
  };
  EXPECT_EQ(finds("int x = static_cast<int>(std::floor(y));"), 1U);
  EXPECT_EQ(finds("auto n = static_cast<std::size_t>(\n    std::ceil(y));"), 1U);
  EXPECT_EQ(finds("long n = std::lround(y);"), 1U);
  EXPECT_EQ(finds("int x = saturating_cast<int>(std::floor(y));"), 0U);
}

}  // namespace
}  // namespace atelier::fixtures
