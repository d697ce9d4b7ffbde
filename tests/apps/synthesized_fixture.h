#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {

/// A coarse reconstruction with few sweeps: enough for which views are used and what is said.
inline const std::vector<std::string> kQuickReconstruction = {
    "--surface.octree_depth", "6", "--surface.edge_length", "0.03",
    "--stereo.iterations",    "2", "--stereo.refinements",  "1"};

/// A small synthetic capture of eight cameras for all tests of a fixture, and a copy for each.
/// @tparam Made  has kFlags, what synthesize is told besides
template <class Made>
class SynthesizedFixture : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    std::vector<std::string> command = {program_path(), "synthesize", original().string()};
    for (const char* flag : {"--dome.cameras", "8", "--edge_length", "0.05", "--substeps", "6"}) {
      command.emplace_back(flag);
    }
    command.insert(command.end(), Made::kFlags.begin(), Made::kFlags.end());
    made_ = run_child(command);
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::filesystem::path original() { return folder_->path() / "capture"; }

  void SetUp() override {
    ASSERT_EQ(made_.exit_code, 0) << made_.err;
    std::filesystem::copy(original(), capture_, std::filesystem::copy_options::recursive);
  }
  /// Runs a stage on the copy. @param more  its flags
  ChildResult stage(const std::string& name, const std::vector<std::string>& more) const {
    std::vector<std::string> command = {program_path(), name, capture_.string(),
                                        workspace_.string()};
    command.insert(command.end(), more.begin(), more.end());
    return run_child(command);
  }
  std::filesystem::path result(const std::string& name) const {
    return workspace_ / name / "current";
  }

  static inline TemporaryDirectory* folder_ = nullptr;
  static inline ChildResult made_ = {};
  TemporaryDirectory own_;
  std::filesystem::path capture_ = own_.path() / "capture";
  std::filesystem::path workspace_ = own_.path() / "workspace";
};

}  // namespace atelier::fixtures
