// `atelier run` on images without calibration, with images of a board beside them.
#ifdef ATELIER_HAS_CAPTURE

#include <nlohmann/json.hpp>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/image_file.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

ChildResult run_recording(const fs::path& recording, const fs::path& workspace,
                          const std::vector<std::string>& more = {}) {
  std::vector<std::string> command = {"env",
                                      "XDG_DATA_HOME=/nowhere",
                                      program_path(),
                                      "run",
                                      recording.string(),
                                      workspace.string(),
                                      "--to",
                                      "validate"};
  command.insert(command.end(), more.begin(), more.end());
  return run_child(command);
}

/// Two cameras with an image each, of nothing.
void write_images(const fs::path& recording) {
  for (const char* camera : {"left", "right"}) {
    fs::create_directories(recording / "images" / camera);
    write_image(recording / "images" / camera / "000001.png", ByteImage(640, 480, 3, 90));
  }
}

TEST(Recording, DryRun_ListsWhatLeadsToACapture) {
  ATELIER_TEST_FILE(boards, "opencv_stereo_chessboard");
  const TemporaryDirectory folder;
  write_images(folder / "recording");
  fs::copy(boards, folder / "recording" / "boards");
  const ChildResult result = run_recording(folder / "recording", folder / "work", {"--dry-run"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const char* step : {"lenses", "keypoints", "poses", "capture", "views"}) {
    EXPECT_THAT(result.out, HasSubstr("would make " + std::string(step)));
  }
  EXPECT_FALSE(fs::exists(folder / "work.recording"));
  const ChildResult json =
      run_recording(folder / "recording", folder / "work", {"--dry-run", "--json"});
  EXPECT_EQ(json.exit_code, 0) << json.err;
  std::istringstream lines(json.out);
  int prepared = 0;
  nlohmann::json last;
  for (std::string line; std::getline(lines, line);) {
    last = nlohmann::json::parse(line);
    prepared += last.at("event") == "prepare" ? 1 : 0;
  }
  EXPECT_EQ(prepared, 5) << json.out;
  EXPECT_EQ(last.at("event"), "run_end");
  EXPECT_TRUE(last.at("stages").empty());
}

TEST(Recording, StepThatFails_IsNamedAndWhatWasDoneIsKept) {
  ATELIER_TEST_FILE(boards, "opencv_stereo_chessboard");
  const TemporaryDirectory folder;
  write_images(folder / "it's a recording");
  const std::vector<std::string> with = {"--boards", boards.string()};
  const ChildResult first = run_recording(folder / "it's a recording", folder / "work", with);
  EXPECT_EQ(first.exit_code, 5) << first.out << first.err;
  EXPECT_THAT(first.out, HasSubstr("lenses: atelier calibrate"));
  EXPECT_THAT(first.out, HasSubstr("it'\\''s a recording'"));
  EXPECT_THAT(first.err, HasSubstr("scripts/detector-networks"));
  EXPECT_TRUE(fs::exists(folder / "work.recording/lenses/lenses.json"));
  EXPECT_FALSE(fs::exists(folder / "work"));
  const ChildResult second = run_recording(folder / "it's a recording", folder / "work", with);
  EXPECT_EQ(second.exit_code, 5);
  EXPECT_THAT(second.out, Not(HasSubstr("lenses: atelier calibrate")));
}

TEST(Recording, BoardThatNobodyShows_IsRefused) {
  const TemporaryDirectory folder;
  write_images(folder / "recording");
  fs::copy(folder / "recording" / "images", folder / "recording" / "calibration",
           fs::copy_options::recursive);
  const ChildResult result = run_recording(folder / "recording", folder / "work");
  EXPECT_EQ(result.exit_code, 3) << result.out;
  EXPECT_THAT(result.err, HasSubstr("no chessboard or ChArUco board"));
}

TEST(Recording, StatureThatNobodyHas_IsRefused) {
  const TemporaryDirectory folder;
  write_images(folder / "recording");
  for (const char* stature : {"175", "0", "tall", "1.75m", ""}) {
    const ChildResult result =
        run_recording(folder / "recording", folder / "work", {"--stature", stature});
    EXPECT_EQ(result.exit_code, 2) << stature;
    EXPECT_THAT(result.err, HasSubstr("--stature"));
  }
}

}  // namespace
}  // namespace atelier::fixtures

#endif
