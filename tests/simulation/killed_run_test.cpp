#include <csignal>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "simulation/cloth_state_archive.h"
#include "tests/simulation/falling_sheet.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

/// tests/simulation/program/falling_sheet.cpp, beside the tests.
std::string falling_sheet_program() {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "falling_sheet").string();
}

TEST(KilledRun, KilledProcess_ResumesBitIdentical) {
  for (Device device : fixtures::devices()) {
    fixtures::FallingSheet whole(device);
    while (whole.state().frame < fixtures::FallingSheet::kFrames) {
      whole.advance();
    }
    const fixtures::TemporaryDirectory folder;
    const std::filesystem::path path = folder / "state.h5";
    for (int dies : {2, 9, -1}) {
      const fixtures::ChildResult result = fixtures::run_child(
          {falling_sheet_program(), path.string(), std::to_string(dies), device_name(device)});
      if (dies >= 0) {
        ASSERT_EQ(result.signal, SIGKILL) << result.out << result.err;
      } else {
        ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
      }
    }
    const ClothState expected = whole.state();
    const ClothState end = cloth_state_of(read_archive(path, "atelier.cloth_state", 1),
                                          expected.positions.rows(), path.string());
    EXPECT_EQ(end.frame, fixtures::FallingSheet::kFrames);
    EXPECT_EQ(end.positions, expected.positions) << device_name(device);
    EXPECT_EQ(end.velocities, expected.velocities) << device_name(device);
  }
}

}  // namespace
}  // namespace atelier
