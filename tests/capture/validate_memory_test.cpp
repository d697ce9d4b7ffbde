// Memory that validating takes for each camera and frame of a long recording: pages of a process of
// its own, of two lengths.

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numeric>

#include <gtest/gtest.h>

#include "capture/layouts/open_dataset.h"
#include "capture/validate.h"
#include "core/store/input_digest.h"
#include "tests/capture/small_capture.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;

/// A capture of so many frames: hard links to one image, one label image and an empty detection.
void write_long_capture(const fs::path& folder, int frames) {
  SmallCapture small;
  small.frames = {0};
  small.detections = false;
  write_small_capture(folder, small);
  for (const Camera& camera : small.cameras) {
    write_file_atomically(folder / "keypoints2d" / camera.id / "000000.json",
                          "{\"version\": 1.3, \"people\": []}");
    for (const auto& [part, extension] :
         {std::pair("images", ".png"), {"labels", ".png"}, {"keypoints2d", ".json"}}) {
      const fs::path files = folder / part / camera.id;
      const auto file = [&, end = extension](int frame) {
        return files / (frame_name(frame) + end);
      };
      constexpr int kLinks = 30'000;  // of one file, which file systems bound
      for (int frame = 1; frame < frames; ++frame) {
        const int first = frame / kLinks * kLinks;
        frame == first ? fs::copy(file(0), file(frame))
                       : fs::create_hard_link(file(first), file(frame));
      }
    }
  }
  CaptureInfo info = read_capture_info(folder);
  info.sequences.front().frame_ids.resize(static_cast<std::size_t>(frames));
  std::iota(info.sequences.front().frame_ids.begin(), info.sequences.front().frame_ids.end(), 0);
  write_file_atomically(folder / "capture.toml", capture_toml(info));
}

constexpr const char* kFolder = "ATELIER_TEST_LONG_CAPTURE";

/// Validates the capture that the environment names, in a process of its own, and prints the peak
/// of its memory.
TEST(ValidateMemory, DISABLED_Child) {
  const fs::path folder = std::getenv(kFolder);
  FrameReader reader(open_dataset(folder));
  ValidateOptions options;
  options.frames.every = 100;
  validate(reader, options);
  stamp_of_input(folder);
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) {
      std::printf("%s\n", line.c_str());
    }
  }
}

/// Bytes that it takes at most.
double peak_of(const fs::path& folder) {
  setenv(kFolder, folder.c_str(), 1);
  const ChildResult child =
      run_child({fs::read_symlink("/proc/self/exe").string(), "--gtest_also_run_disabled_tests",
                 "--gtest_filter=ValidateMemory.DISABLED_Child"});
  const std::size_t at = child.out.find("VmHWM:");
  EXPECT_EQ(child.exit_code, 0) << child.out;
  return at == std::string::npos ? 0 : 1024 * std::stod(child.out.substr(at + 6));
}

TEST(ValidateMemory, LongRecording_TakesAHundredBytesACameraAndFrame) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer's own memory counts";
#endif
  const TemporaryDirectory folder;
  constexpr int kShort =
      6000;  // detections of 5,000 frames at most are held against the calibration
  const int longer = std::getenv("ATELIER_SOAK") != nullptr ? 300'000 : 20'000;  // by three cameras
  constexpr double kCameras = 3;
  write_long_capture(folder / "short", kShort);
  write_long_capture(folder / "long", longer);
  const double before = peak_of(folder / "short");
  const double bytes = (peak_of(folder / "long") - before) / (kCameras * (longer - kShort));
  RecordProperty("bytes", std::to_string(bytes));
  std::printf("validate: %.1f bytes a camera and frame\n", bytes);
  EXPECT_LT(bytes, 100);
}

}  // namespace
}  // namespace atelier::fixtures
