#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/motion_bvh.h"
#include "core/io/file_bytes.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {

/// A trunk in a skirt that walks three frames.
class Animate : public ::testing::Test {
 protected:
  void SetUp() override {
    if (run({"animate", "--help"}).out.find("--cloth-sequence") == std::string::npos) {
      GTEST_SKIP() << "built without animate";
    }
  }

  static ChildResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program_path());
    return run_child(arguments);
  }
  ChildResult stage(const std::string& name, std::vector<std::string> more = {}) const {
    std::vector<std::string> all{name, capture().string(), workspace().string()};
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
  }
  /// Without images, which take most of the time.
  ChildResult animate(const std::vector<std::string>& more = {}) const {
    return stage("animate",
                 with_usual({"--pictures", "false", "--cloth.xpbd.substeps", "6"}, more));
  }
  void expect_refused(const ChildResult& result, const std::string& words, int code = 3) const {
    EXPECT_EQ(result.exit_code, code) << result.err << result.out;
    EXPECT_THAT(result.err, ::testing::HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(workspace() / "animate" / "current"));
  }

  std::filesystem::path capture() const { return root_ / "capture"; }
  std::filesystem::path workspace() const { return root_ / "work"; }
  std::filesystem::path result() const { return workspace() / "animate" / "current"; }
  nlohmann::json metrics(const std::string& of = "animate") const {
    return nlohmann::json::parse(
        read_file_text(workspace() / of / "current" / "manifest.json", 1 << 20))["metrics"];
  }
  std::filesystem::path motion(const MotionClip& clip) const {
    const std::filesystem::path file = root_ / "motion.bvh";
    write_bvh(file, clip);
    return file;
  }

  TemporaryDirectory root_;
};

}  // namespace atelier::fixtures
