#pragma once

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/file_bytes.h"
#include "core/sha256.h"
#include "core/store/result.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {

/// Writes `frames` boxes that grow, box_000.obj and so on.
inline void write_boxes(const std::filesystem::path& folder, int frames) {
  std::filesystem::create_directories(folder);
  for (int i = 0; i < frames; ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "box_%03d.obj", i);
    std::ofstream file(folder / name);
    const double width = 1 + 0.01 * i;
    for (int corner = 0; corner < 8; ++corner) {
      file << "v " << (corner & 4 ? width : 0) << " " << (corner & 2 ? 1 : 0) << " "
           << (corner & 1 ? 1 : 0) << "\n";
    }
    file << "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n";
  }
}

/// The program `atelier` on boxes, in a folder that is gone after the test.
class StatisticsFixture : public ::testing::Test {
 protected:
  std::filesystem::path input() const { return root_ / "boxes"; }
  std::filesystem::path workspace() const { return root_ / "work"; }
  std::filesystem::path stage_folder() const { return workspace() / "statistics"; }

  static std::vector<std::string> atelier(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program_path());
    return arguments;
  }
  /// The stage on the boxes, by the program that starts quickly.
  std::vector<std::string> statistics(std::vector<std::string> more = {}) const {
    std::vector<std::string> command = {small_program_path(), "statistics", input().string(),
                                        workspace().string()};
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }
  static ChildResult run(std::vector<std::string> arguments) {
    return run_child(atelier(std::move(arguments)));
  }

  /// Digest of every file of the current result but the manifest, by name.
  std::map<std::string, std::string> result_digests() const {
    return digests_in(stage_folder() / "current");
  }
  /// The same of any result; none where there is none.
  static std::map<std::string, std::string> digests_in(const std::filesystem::path& result) {
    std::map<std::string, std::string> digests;
    if (!std::filesystem::exists(result)) {
      return digests;
    }
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(std::filesystem::canonical(result))) {
      if (entry.is_regular_file() && entry.path().filename() != "manifest.json") {
        digests[entry.path().filename().string()] =
            hex(sha256(read_file_text(entry.path(), 1 << 24)));
      }
    }
    return digests;
  }

  /// True if the workspace holds one sound result and nothing else but locks.
  ::testing::AssertionResult is_clean() const {
    const std::filesystem::path result = std::filesystem::canonical(stage_folder() / "current");
    for (const Finding& finding :
         check_outputs(result, read_manifest(result, "statistics"), Check::Digests)) {
      return ::testing::AssertionFailure() << to_string(finding);
    }
    for (const auto& entry : std::filesystem::directory_iterator(stage_folder())) {
      const std::string name = entry.path().filename().string();
      if (name != ".lock" && name != ".commit-lock" && name != "current" && name.size() != 16) {
        return ::testing::AssertionFailure() << "left behind: " << name;
      }
    }
    return ::testing::AssertionSuccess();
  }

  void forget_workspace() const { std::filesystem::remove_all(workspace()); }

  TemporaryDirectory root_;
};

}  // namespace atelier::fixtures
