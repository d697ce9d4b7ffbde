#include "simulation/simulation_table.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

TEST(SimulatedFrameFile, FrameOtherThanItsFileName_IsRefused) {
  const fixtures::TemporaryDirectory root;
  SimulatedFrame frame;
  frame.state.positions = Points::Ones(4, 3);
  frame.state.velocities = Points::Zero(4, 3);
  frame.state.frame = 7;
  const std::filesystem::path file = root.path() / "000007.h5";
  write_archive(file, archive_of(frame));
  EXPECT_EQ(read_simulated_frame(file, 7, 4).report.frame, 7);
  for (const int named : {6, 8, 1}) {
    try {
      read_simulated_frame(file, named, 4);
      FAIL() << named;
    } catch (const DataError& error) {
      EXPECT_EQ(error.where, "frame");
      EXPECT_EQ(error.found, "7");
      EXPECT_THAT(error.expected, HasSubstr(std::to_string(named) + ", as the file is named"));
    }
  }
}

}  // namespace
}  // namespace atelier
