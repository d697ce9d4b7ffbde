#pragma once

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/file_bytes.h"
#include "core/store/result.h"
#include "core/store/run_stage.h"
#include "tests/core_store/test_stages.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {

inline void write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

inline std::string read(const std::filesystem::path& path) {
  return read_file_text(path, 1 << 20);
}

/// An input, a workspace, and the test stages run on them.
class RunStage : public ::testing::Test {
 protected:
  RunStage() {
    behaviour() = {};
    write(root_ / "in/a.txt", "3");
  }

  StageRequest request(std::string_view stage) {
    StageRequest result;
    result.input = root_ / "in";
    result.workspace = root_ / "work";
    result.options = find_stage(kTestStages, stage)->options();
    result.jobs = 1;
    return result;
  }
  StageReport run(std::string_view stage, const StageRequest& what,
                  const StageEvents& events = {}) {
    return run_stage(kTestStages, *find_stage(kTestStages, stage), what, events);
  }
  StageReport run(std::string_view stage) { return run(stage, request(stage)); }
  std::filesystem::path folder(std::string_view stage) { return root_ / "work" / stage; }
  std::filesystem::path current(std::string_view stage) {
    return folder(stage) / current_name(folder(stage)).value_or("none");
  }
  template <class Error>
  std::string refusal(std::string_view stage, const StageRequest& what) {
    try {
      run(stage, what);
    } catch (const Error& error) {
      return error.what();
    }
    return "it ran";
  }
  std::vector<std::string> names(const std::filesystem::path& path) {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(path)) {
      found.push_back(entry.path().filename().string());
    }
    std::sort(found.begin(), found.end());
    return found;
  }

  TemporaryDirectory root_;
};

}  // namespace atelier::fixtures
