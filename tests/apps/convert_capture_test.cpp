// `atelier convert-capture`: there and back, what it says, what it refuses.
#ifdef ATELIER_HAS_CAPTURE

#include <csignal>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/layouts/open_dataset.h"
#include "core/io/cameras_file.h"
#include "core/store/consent_file.h"
#include "core/store/file_lock.h"
#include "tests/apps/system_calls.h"
#include "tests/capture/small_capture.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

ChildResult convert(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {program_path(), "convert-capture"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_child(command);
}

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    files.push_back(entry.path());
  }
  return files;
}

TEST(ConvertCapture, ConvertedCapture_RoundTrips) {
  const TemporaryDirectory folder;
  const SmallCapture small;
  write_small_capture(folder / "capture", small);
  const std::string out = (folder / "colmap").string();
  const ChildResult there = convert({(folder / "capture").string(), out, "--to", "colmap_binary"});
  ASSERT_EQ(there.exit_code, 0) << there.err;
  EXPECT_THAT(there.out, HasSubstr("native (capture.toml and cameras.json), 3 cameras, 2 frames"));
  EXPECT_THAT(there.out, HasSubstr("colmap_binary: frame rate"));
  const std::string back = (folder / "back").string();
  const ChildResult here =
      convert({out + "/clothed", back, "--metres-per-unit", "1", "--up", "y", "--fps", "12"});
  ASSERT_EQ(here.exit_code, 0) << here.err;
  const std::vector<Camera> cameras = read_cameras(back);
  ASSERT_EQ(cameras.size(), 3U);
  const Eigen::Vector3d point(0.1, 1, 0.2);
  EXPECT_LT((*project(cameras[1], point) - *project(small.cameras[1], point)).norm(), 1e-9);
}

TEST(ConvertCapture, ErrorsInWhatIsRead_AreTheExitCodeAndLoseNothing) {
  const TemporaryDirectory folder;
  SmallCapture small;
  write_small_capture(folder / "capture", small);
  for (Camera& camera : small.cameras) {  // as calibrated before the images were turned
    std::swap(camera.width, camera.height);
    std::swap(camera.cx, camera.cy);
  }
  write_file_atomically(folder / "capture" / "cameras.json", cameras_json(small.cameras));
  const std::string out = (folder / "out").string();
  const ChildResult result = convert({(folder / "capture").string(), out, "--to", "native"});
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.out, HasSubstr("error image-turned"));
  EXPECT_THAT(result.out, HasSubstr("written as it was read, with 3 errors in it"));
  EXPECT_EQ(read_cameras(out).size(), 3U);
}

TEST(ConvertCapture, EveryLayout_KeepsConsent) {
  const TemporaryDirectory folder;
  SmallCapture small;
  small.consent = {{"P. Doe", "research", "2999-12-31"}};
  write_small_capture(folder / "capture", small);
  const std::string capture = (folder / "capture").string();
  for (const char* layout : {"native", "easymocap", "colmap", "images"}) {
    const fs::path out = folder / layout;
    const ChildResult there = convert({capture, out.string(), "--to", layout});
    ASSERT_EQ(there.exit_code, 0) << there.err;
    EXPECT_THAT(there.out, HasSubstr("consent: P. Doe, research, until 2999-12-31"));
    const fs::path read = std::string(layout) == "native" ? out : out / "clothed";
    EXPECT_EQ(read_consent(read), small.consent) << layout;
    EXPECT_EQ(open_dataset(read).info.consent, small.consent) << layout;
    EXPECT_EQ(fs::exists(out / "consent.toml"), std::string(layout) != "native");
  }
}

TEST(ConvertCapture, SequencesOfOneRig_AreJoined) {
  const TemporaryDirectory folder;
  write_small_capture(folder / "a");
  SmallCapture later;
  later.frames = {7, 8};
  write_small_capture(folder / "b", later);
  const std::string a = (folder / "a").string();
  const std::string b = (folder / "b").string();
  const std::string out = (folder / "out").string();
  const ChildResult joined = convert({a, b, out, "--join", "clothed,minimal"});
  ASSERT_EQ(joined.exit_code, 0) << joined.err;
  EXPECT_THAT(joined.out, HasSubstr("3 cameras, 4 frames"));
  const CaptureInfo info = open_dataset(out).info;
  ASSERT_EQ(info.sequences.size(), 2U);
  EXPECT_EQ(info.sequences[1].kind, "minimal");
  const ChildResult two = convert({a, b, "--join", "clothed,minimal"});
  EXPECT_EQ(two.exit_code, 2);
  EXPECT_THAT(two.err, HasSubstr("convert-capture A B OUT --join clothed,minimal"));
  const ChildResult unsaid = convert({a, b, (folder / "new").string()});
  EXPECT_EQ(unsaid.exit_code, 2);
  EXPECT_THAT(unsaid.err, HasSubstr("--join makes one capture of several"));
  const ChildResult kind = convert({a, b, (folder / "new").string(), "--join", "clothed,naked"});
  EXPECT_EQ(kind.exit_code, 2);
  EXPECT_THAT(kind.err, HasSubstr("'naked': clothed or minimal"));
  EXPECT_FALSE(fs::exists(folder / "new"));
}

TEST(ConvertCapture, MissingConsent_IsReported) {
  const TemporaryDirectory folder;
  write_small_capture(folder / "capture");
  const ChildResult there =
      convert({(folder / "capture").string(), (folder / "out").string(), "--to", "images"});
  EXPECT_THAT(there.out, HasSubstr("consent: none recorded"));
  EXPECT_FALSE(fs::exists(folder / "out" / "consent.toml"));
}

TEST(ConvertCapture, EndedConsent_IsReported) {
  const TemporaryDirectory folder;
  SmallCapture small;
  small.consent = {{"P. Doe", "research", "2020-12-31"}};
  write_small_capture(folder / "capture", small);
  const ChildResult there =
      convert({(folder / "capture").string(), (folder / "out").string(), "--to", "images"});
  EXPECT_EQ(there.exit_code, 0);
  EXPECT_THAT(there.err, HasSubstr("warning consent-ended ["));
  EXPECT_THAT(there.err, HasSubstr("P. Doe"));
}

/// Commands beside the stages. Whether they can do their work with so small a capture is another
/// matter.
TEST(Commands, EndedConsent_IsReportedByAllThatReadACapture) {
  const TemporaryDirectory folder;
  SmallCapture small;
  small.consent = {{"P. Doe", "research", "2020-12-31"}};
  write_small_capture(folder / "capture", small);
  const std::string capture = (folder / "capture").string();
  const std::string out = (folder / "out").string();
  const std::vector<std::vector<std::string>> commands = {
      {"masks", capture, "--out", out + "-masks"},
      {"depth", capture, out + "-depth"},
      {"calibrate-color", capture, "--out", out + "-color.json"}};
  for (std::vector<std::string> words : commands) {
    const std::string name = words.front();
    words.insert(words.begin(), program_path());
    EXPECT_THAT(run_child(words).err, HasSubstr("warning consent-ended [")) << name;
  }
}

TEST(ConvertCapture, StoppedConversion_LeavesNoPartialCapture) {
  if (!can_inject()) {
    GTEST_SKIP() << "strace cannot trace here";
  }
  const TemporaryDirectory folder;
  write_small_capture(folder / "capture");
  fs::create_directory(folder / "new");
  const fs::path out = folder / "new/out";
  for (const char* layout : {"native", "easymocap"}) {
    const std::vector<std::string> command = {
        program_path(), "convert-capture", (folder / "capture").string(), out.string(), "--to",
        layout};
    const std::vector<SystemCall> calls = record_calls(command, {"rename"});
    ASSERT_GE(calls.size(), 6U) << "an image of each frame and camera";
    const std::size_t files = files_in(out).size();
    fs::remove_all(out);
    for (const int signal : {SIGTERM, SIGINT, SIGKILL}) {
      SCOPED_TRACE(std::string(layout) + " " + strsignal(signal));
      const ChildResult ended =
          run_child(injected(command, calls[3], "signal=" + std::to_string(signal)));
      EXPECT_EQ(ended.signal, signal) << ended.err;
      EXPECT_FALSE(fs::exists(out)) << "no part of a capture under its name";
      if (signal != SIGKILL) {
        EXPECT_THAT(ended.out, HasSubstr("stopped; nothing was written"));
        EXPECT_TRUE(fs::is_empty(folder / "new")) << "and none beside it";
      }
      const ChildResult next = run_child(command);
      ASSERT_EQ(next.exit_code, 0) << next.err;
      EXPECT_THAT(next.out, HasSubstr(out.string()));
      EXPECT_EQ(files_in(out).size(), files);
      fs::remove_all(out);
      EXPECT_TRUE(fs::is_empty(folder / "new"));
    }
  }
}

TEST(ConvertCapture, OutputOfAnotherRun_IsRefused) {
  const TemporaryDirectory folder;
  write_small_capture(folder / "capture");
  fs::create_directory(folder / ".out.unfinished");
  const std::vector<std::string> arguments = {(folder / "capture").string(),
                                              (folder / "out").string()};
  {
    const auto lock =
        FileLock::try_lock_folder(folder / ".out.unfinished", FileLock::Mode::Exclusive);
    const ChildResult second = convert(arguments);
    EXPECT_EQ(second.exit_code, 5);
    EXPECT_THAT(second.err, HasSubstr("another run is writing it"));
    EXPECT_TRUE(fs::exists(folder / ".out.unfinished"));
  }
  EXPECT_EQ(convert(arguments).exit_code, 0);
  EXPECT_FALSE(fs::exists(folder / ".out.unfinished"));
}

TEST(ConvertCapture, CaptureJoinedWithItself_IsRefused) {
  const TemporaryDirectory folder;
  write_small_capture(folder / "a");
  fs::copy(folder / "a", folder / "copy", fs::copy_options::recursive);
  fs::create_directory_symlink(folder / "a", folder / "link");
  SmallCapture later;
  later.frames = {5, 6};
  write_small_capture(folder / "b", later);
  const std::string a = (folder / "a").string();
  const std::string out = (folder / "out").string();
  for (const char* second : {"a", "copy", "link"}) {
    const ChildResult twice =
        convert({a, (folder / second).string(), out, "--join", "clothed,clothed"});
    EXPECT_EQ(twice.exit_code, 2) << second;
    EXPECT_THAT(twice.err, HasSubstr("--join takes each capture once: "));
    EXPECT_FALSE(fs::exists(out));
  }
  const ChildResult two = convert({a, (folder / "b").string(), out, "--join", "clothed,clothed"});
  EXPECT_EQ(two.exit_code, 0) << two.err;
  const ChildResult few = convert({a, (folder / "b").string(), out, "--join", "clothed"});
  EXPECT_EQ(few.exit_code, 2);
  EXPECT_THAT(few.err, HasSubstr("--join names 1 kind, and 2 captures come before OUT"));
  const ChildResult many = convert({a, out, "--join", "clothed,clothed"});
  EXPECT_EQ(many.exit_code, 2);
  EXPECT_THAT(many.err, HasSubstr("--join names 2 kinds, and 1 capture comes before OUT"));
}

TEST(ConvertCapture, NonCaptureOrTakenPlace_IsRefused) {
  const TemporaryDirectory folder;
  fs::create_directory(folder / "empty");
  const std::string empty = (folder / "empty").string();
  const ChildResult none = convert({empty, (folder / "out").string()});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("no layout that is known"));
  write_small_capture(folder / "capture");
  const std::string capture = (folder / "capture").string();
  const ChildResult taken = convert({capture, empty});
  EXPECT_EQ(taken.exit_code, 2);
  EXPECT_THAT(taken.err, HasSubstr("already exists, and no flag replaces it; choose another OUT"));
  EXPECT_TRUE(fs::is_empty(empty));
  const ChildResult layout = convert({capture, (folder / "x").string(), "--to", "colmapp"});
  EXPECT_EQ(layout.exit_code, 2);
  const ChildResult inside = convert({capture, capture + "/colmap", "--to", "colmap"});
  EXPECT_EQ(inside.exit_code, 2);
  EXPECT_THAT(inside.err, HasSubstr("OUT lies in the capture " + capture + ", which is not"));
  EXPECT_EQ(convert({capture + "/cameras.json", capture + "/out"}).exit_code, 2);
  EXPECT_FALSE(fs::exists(capture + "/colmap"));
  const ChildResult up = convert({capture, (folder / "x").string(), "--up", "w"});
  EXPECT_EQ(up.exit_code, 2);
}

}  // namespace
}  // namespace atelier::fixtures

#endif
