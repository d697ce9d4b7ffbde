// What the scripts say of arguments that they cannot use.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/child_process.h"
#include "tests/support/places.h"

namespace atelier::fixtures {
namespace {

TEST(ScriptsRefused, AnOptionWithoutItsValue) {
  const std::vector<std::vector<std::string>> commands = {
      {"lint", "--build"}, {"lint", "--base"},   {"lint", "--base", ""},
      {"lint", "--bas"},   {"test", "--preset"}, {"test", "--pres"}};
  for (std::vector<std::string> command : commands) {
    const std::string name = command[0];
    command[0] = (source_directory() / "scripts" / name).string();
    SCOPED_TRACE(name + " " + command[1]);
    const ChildResult result = run_child(command);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, ::testing::StartsWith("usage: scripts/" + name + " ["));
  }
}

}  // namespace
}  // namespace atelier::fixtures
