#ifdef ATELIER_HAS_CUDA

#include "tests/support/device_memory.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/device.h"
#include "core/io/file_bytes.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using fixtures::ChildProcess;
using fixtures::ChildResult;
using ::testing::HasSubstr;

/// `simulate --device cuda` where the device has no memory left. Others on the device fail
/// meanwhile, so on request alone.
class SimulateOutOfDeviceMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* soak = std::getenv("ATELIER_SOAK");
    if (soak == nullptr || std::string(soak) != "1") {
      GTEST_SKIP() << "part of scripts/soak";
    }
    if (!cuda_available()) {
      GTEST_SKIP() << "no CUDA device";
    }
    fs::create_directories(scene());
    std::ofstream(scene() / "body.obj") << "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\n"
                                           "f 1 3 2\nf 1 4 3\n";
    // A pile of sheets that touches nothing for half a second: then lists of pairs grow tenfold.
    std::ofstream garment(scene() / "garment.obj");
    constexpr int kSheets = 12;
    constexpr int kSide = 25;
    for (int k = 0; k < kSheets; ++k) {
      for (int i = 0; i < kSide * kSide; ++i) {
        garment << "v " << 0.01 * (i % kSide) - 0.12 << " " << 1.2 + 0.02 * k << " "
                << 0.01 * (i / kSide) - 0.12 << "\n";
      }
    }
    for (int k = 0; k < kSheets; ++k) {
      for (int i = 0; i < (kSide - 1) * (kSide - 1); ++i) {
        const int a = k * kSide * kSide + i / (kSide - 1) * kSide + i % (kSide - 1) + 1;
        garment << "f " << a << " " << a + kSide << " " << a + kSide + 1 << "\nf " << a << " "
                << a + kSide + 1 << " " << a + 1 << "\n";
      }
    }
  }

  fs::path scene() const { return root_.path() / "scene"; }
  std::vector<std::string> alone(const fs::path& out) const {
    return {fixtures::program_path(),
            "simulate",
            "--garment",
            (scene() / "garment.obj").string(),
            "--body",
            (scene() / "body.obj").string(),
            "--out",
            out.string(),
            "--format",
            "ply",
            "--settle",
            "60",
            "--no-pictures",
            "--device",
            "cuda"};
  }
  std::vector<std::string> stage(const fs::path& workspace) const {
    return {fixtures::program_path(),
            "simulate",
            scene().string(),
            workspace.string(),
            "--settle",
            "60",
            "--device",
            "cuda"};
  }

  /// The path in `folder` that ends in `name`, or "".
  static fs::path find(const fs::path& folder, const std::string& name) {
    std::error_code gone;  // files come and go
    for (fs::recursive_directory_iterator it(folder, gone), end; !gone && it != end;
         it.increment(gone)) {
      if (it->path().string().ends_with(name)) {
        return it->path();
      }
    }
    return {};
  }

  /// Runs a command whose device's memory is gone from the time on when `first` lies in `folder`.
  static ChildResult starved(const std::vector<std::string>& command, const fs::path& folder,
                             const std::string& first) {
    ChildProcess child(command);
    while (find(folder, first).empty() && !child.has_ended()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    child.kill(SIGSTOP);  // until all of it is taken
    const fixtures::FullDevice full;
    child.kill(SIGCONT);
    return child.wait();
  }
  static void expect_want_of_memory(const ChildResult& result) {
    EXPECT_EQ(result.exit_code, 5) << result.out;
    EXPECT_THAT(result.err, HasSubstr("out of memory: "));
    EXPECT_THAT(result.err, HasSubstr(" free of "));
    EXPECT_THAT(result.err, HasSubstr("use --device cpu"));
    EXPECT_THAT(result.err, HasSubstr("a coarser garment"));
  }

  fixtures::TemporaryDirectory root_;
};

// Not even the program's own code may fit, of which the driver has words of its own.
TEST_F(SimulateOutOfDeviceMemory, NoMemoryAtTheStart_GivesOneLineOfAdvice) {
  const fs::path out = root_.path() / "out";
  ChildResult result;
  {
    const fixtures::FullDevice full;
    result = fixtures::run_child(alone(out));
  }
  EXPECT_EQ(result.exit_code, 5) << result.out;
  EXPECT_THAT(result.err, HasSubstr("use --device cpu")) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_TRUE(find(out, ".ply").empty());
}

TEST_F(SimulateOutOfDeviceMemory, NoMemoryDuringARun_KeepsEarlierFrames) {
  const fs::path out = root_.path() / "out";
  const ChildResult result = starved(alone(out), out, "garment_000001.ply");
  expect_want_of_memory(result);
  EXPECT_THAT(result.err, HasSubstr("frames before it are in " + out.string()));
  const std::string table = read_file_text(out / "frames.csv", 1 << 20);
  const auto frames = std::count(table.begin(), table.end(), '\n') - 1;
  EXPECT_GT(frames, 1);
  EXPECT_LT(frames, 60);
  char last[40];
  char next[40];
  std::snprintf(last, sizeof last, "garment_%06d.ply", static_cast<int>(frames));
  std::snprintf(next, sizeof next, "garment_%06d.ply", static_cast<int>(frames) + 1);
  EXPECT_TRUE(fs::exists(out / last));
  EXPECT_FALSE(fs::exists(out / next));
}

TEST_F(SimulateOutOfDeviceMemory, StageWithoutMemory_ResumesBitIdentical) {
  const fs::path whole = root_.path() / "whole";
  const fs::path parts = root_.path() / "parts";
  ASSERT_EQ(fixtures::run_child(stage(whole)).exit_code, 0);
  ChildResult result = starved(stage(parts), parts, "states/000001.h5");
  expect_want_of_memory(result);
  EXPECT_THAT(result.err, HasSubstr("finished frames are kept"));
  result = fixtures::run_child(stage(parts));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out + result.err, HasSubstr(" of 60 frames are done already"));
  for (const char* name : {"states/000060.h5", "garment/sequence.h5", "frames.csv"}) {
    ASSERT_FALSE(find(whole, name).empty()) << name;
    EXPECT_EQ(read_file_text(find(whole, name), 1 << 26),
              read_file_text(find(parts, name), 1 << 26))
        << name;
  }
}

}  // namespace
}  // namespace atelier

#endif
