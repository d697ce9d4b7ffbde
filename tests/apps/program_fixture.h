#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/apps/statistics_fixture.h"

namespace atelier::fixtures {

/// The program as a child process, with a folder of boxes as its input.
class Program : public StatisticsFixture {
 protected:
  /// One readable line on standard error, nothing on standard output, and the code.
  static void expect_refusal(const ChildResult& result, int code, const std::string& words) {
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_THAT(result.err, ::testing::StartsWith("atelier: "));
    EXPECT_THAT(result.err, ::testing::HasSubstr(words));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.out, ::testing::IsEmpty());
  }
  ChildResult run_statistics(std::vector<std::string> more) {
    return run_child(statistics(std::move(more)));
  }
};

}  // namespace atelier::fixtures
