// A capture of the preset `tiny` one frame of which is bad: the frame is left out, said once, and
// the chain goes on.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/capture_info.h"
#include "core/io/image_file.h"
#include "core/sequence_archive.h"
#include "tests/apps/synthesized_fixture.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/read_text.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kBad = "000002";

/// How often a text has some words.
int count_of(const std::string& text, const std::string& words) {
  int count = 0;
  for (std::size_t at = text.find(words); at != std::string::npos;
       at = text.find(words, at + words.size())) {
    ++count;
  }
  return count;
}

std::vector<fs::path> cameras_in(const fs::path& folder) {
  std::vector<fs::path> cameras;
  for (const auto& entry : fs::directory_iterator(folder)) {
    cameras.push_back(entry.path());
  }
  std::sort(cameras.begin(), cameras.end());
  return cameras;
}

struct TinyCapture {
  static inline const std::vector<std::string> kFlags = {
      "--preset",  "tiny", "--ground_truth_images", "false", "--dome.width",  "150",
      "--samples", "1",    "--light-samples",       "6",     "--dome.height", "200"};
};

/// On a capture whose frame 2 is bad.
class BadFrame : public SynthesizedFixture<TinyCapture> {
 protected:
  void empty_masks() const {
    for (const fs::path& camera : cameras_in(capture_ / "labels")) {
      const fs::path file = camera / (std::string(kBad) + ".png");
      const ByteImage before = read_labels(file);
      write_labels(file, ByteImage(before.width, before.height, 1, 0));
    }
  }
  void remove_from(const char* part, std::size_t kept) const {
    const std::vector<fs::path> cameras = cameras_in(capture_ / part);
    for (std::size_t c = kept; c < cameras.size(); ++c) {
      for (const auto& entry : fs::directory_iterator(cameras[c])) {
        if (entry.path().stem() == kBad) {
          fs::remove(entry.path());
        }
      }
    }
  }
  ChildResult stage(const std::string& name, const std::vector<std::string>& more = {}) const {
    const bool quick = name == "reconstruct";
    return SynthesizedFixture::stage(name, quick ? with_usual(kQuickReconstruction, more) : more);
  }
  void expect_gap() const {
    EXPECT_FALSE(fs::exists(result("reconstruct") / "scans" / (std::string(kBad) + ".h5")));
    EXPECT_TRUE(fs::exists(result("reconstruct") / "scans/000001.h5"));
    EXPECT_TRUE(fs::exists(result("reconstruct") / "scans/000003.h5"));
    const auto manifest = nlohmann::json::parse(read_text(result("reconstruct") / "manifest.json"));
    EXPECT_EQ(manifest.at("metrics").at("frames_left_out"), 1);
  }
};

TEST_F(BadFrame, EmptyMasks_AreSaidOnceAndLeftOut) {
  empty_masks();
  const ChildResult result = stage("reconstruct");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(count_of(result.err, "frame-left-out [frame 2]"), 1) << result.err;
  EXPECT_THAT(result.err,
              AllOf(HasSubstr("0 with a subject in them"), Not(HasSubstr("frame 2: "))));
  expect_gap();
}

TEST_F(BadFrame, NoImages_AreSaidOnceAndLeftOut) {
  remove_from("images", 0);
  const ChildResult result = stage("reconstruct");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(count_of(result.err, "frame-without-masks [frame 2]"), 1) << result.err;
  expect_gap();
}

TEST_F(BadFrame, OneView_IsSaidOnceAndLeftOut) {
  remove_from("images", 1);
  const ChildResult result = stage("reconstruct");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(count_of(result.err, "frame-without-masks [frame 2]"), 1) << result.err;
  expect_gap();
}

TEST_F(BadFrame, MoreThanTheAllowedShare_IsRefused) {
  empty_masks();
  const ChildResult none = stage("reconstruct", {"--max-left-out", "0"});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, AllOf(HasSubstr("frame 2, views"), HasSubstr("--max-left-out")));
  EXPECT_EQ(stage("reconstruct", {"--max-left-out", "2"}).exit_code, 2);
  remove_from("images", 0);
  const ChildResult missing = stage("reconstruct", {"--max-left-out", "0"});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr("1 of 6 frames gets no surface"));
  EXPECT_FALSE(fs::exists(result("reconstruct")));
}

TEST_F(BadFrame, RunByFramesAndResumed_KnowsTheGap) {
  empty_masks();
  const ChildResult first = stage("reconstruct", {"--frames", "0:3"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const ChildResult status = run_child({program_path(), "status", workspace_.string()});
  EXPECT_EQ(status.exit_code, 0) << status.err;
  const ChildResult rest = stage("reconstruct");
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_THAT(rest.err, Not(HasSubstr("frame-left-out [frame 2]")));  // it was said
  expect_gap();
  const auto manifest = nlohmann::json::parse(read_text(result("reconstruct") / "manifest.json"));
  EXPECT_EQ(count_of(manifest.at("warnings").dump(), "frame-left-out [frame 2]"), 1);
  EXPECT_EQ(stage("reconstruct").exit_code, 0);  // done already
  const ChildResult checked = run_child({program_path(), "status", workspace_.string(), "--check"});
  EXPECT_EQ(checked.exit_code, 0) << checked.out << checked.err;
}

TEST_F(BadFrame, FirstFrameWithoutSubject_KeepsTheLabelsOfTheOthers) {
  for (const fs::path& camera : cameras_in(capture_ / "labels")) {
    const ByteImage before = read_labels(camera / "000000.png");
    write_labels(camera / "000000.png", ByteImage(before.width, before.height, 1, 0));
  }
  ASSERT_EQ(stage("reconstruct").exit_code, 0);
  const auto manifest = nlohmann::json::parse(read_text(result("reconstruct") / "manifest.json"));
  EXPECT_EQ(manifest.at("metrics").at("labels_by_color"), 0);
}

TEST_F(BadFrame, WholeChain_GoesOnOverTheGap) {
  empty_masks();
  remove_from("keypoints2d", 0);
  std::vector<std::string> command = {program_path(),
                                      "run",
                                      capture_.string(),
                                      workspace_.string(),
                                      "--to",
                                      "register",
                                      "--no-report",
                                      "--personalize.samples",
                                      "800",
                                      "--track.compare",
                                      "false",
                                      "--body.iterations",
                                      "2",
                                      "--body.gap-frames",
                                      "1",
                                      "--template.edge-length",
                                      "0.025",
                                      "--register.photometric-levels",
                                      "1",
                                      "--register.photometric-steps",
                                      "1"};
  for (std::size_t i = 0; i + 1 < kQuickReconstruction.size(); i += 2) {
    command.push_back("--reconstruct." + kQuickReconstruction[i].substr(2));
    command.push_back(kQuickReconstruction[i + 1]);
  }
  const ChildResult ran = run_child(command);
  ASSERT_EQ(ran.exit_code, 0) << ran.out << ran.err;
  for (const char* name : {"personalize", "track", "body", "template", "register"}) {
    EXPECT_TRUE(fs::exists(result(name))) << name;
  }
  EXPECT_TRUE(fs::exists(result("body") / "frames/000002.h5"));  // by its neighbours
  const ChildResult measured = run_child({program_path(), "evaluate", workspace_.string(),
                                          "--ground-truth", capture_.string(), "--json"});
  EXPECT_EQ(measured.exit_code, 0) << measured.err;
  const ChildResult report = run_child({program_path(), "report", workspace_.string()});
  EXPECT_EQ(report.exit_code, 0) << report.err;
}

}  // namespace
}  // namespace atelier::fixtures

#endif
