#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/store/result.h"
#include "tests/capture/small_capture.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {

/// `atelier run` on a capture without masks: three cameras, two frames.
class Run : public ::testing::Test {
 protected:
  void SetUp() override {
    write_small_capture(capture_, SmallCapture());
    std::filesystem::remove_all(capture_ / "labels");
  }
  std::vector<std::string> command(std::vector<std::string> more = {}) const {
    std::vector<std::string> all = {program_path(), "run", capture_.string(), workspace_.string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  ChildResult run(std::vector<std::string> more = {}) const {
    return run_child(command(std::move(more)));
  }
  bool has_result(const std::string& stage) const {
    return current_name(workspace_ / stage).has_value();
  }
  Manifest manifest(const std::string& stage) const {
    return read_manifest(workspace_ / stage / *current_name(workspace_ / stage), stage);
  }
  std::filesystem::path toml(const std::string& text) const {
    const std::filesystem::path file = root_ / "options.toml";
    std::ofstream(file) << text;
    return file;
  }
  static void expect_refusal(const ChildResult& result, int code, const std::string& words) {
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_THAT(result.err,
                ::testing::AllOf(::testing::HasSubstr("atelier: "), ::testing::HasSubstr(words)));
  }

  TemporaryDirectory root_;
  std::filesystem::path capture_ = root_.path() / "capture";
  std::filesystem::path workspace_ = root_.path() / "work";
};

}  // namespace atelier::fixtures
