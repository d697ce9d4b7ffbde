// `atelier calibrate`: real boards to cameras.json, lenses that are kept, and what it refuses.
#ifdef ATELIER_HAS_CAPTURE

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/cameras_file.h"
#include "core/io/image_file.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

ChildResult calibrate(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {program_path(), "calibrate"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_child(command);
}

TEST(CalibrateCommand, StereoChessboards_GiveCameras) {
  ATELIER_TEST_FILE(pictures, "opencv_stereo_chessboard");
  const TemporaryDirectory folder;
  const fs::path out = folder / "rig";
  const std::vector<std::string> arguments = {pictures.string(), "--out", out.string(),
                                              "--board.square", "0.025"};
  const ChildResult done = calibrate(arguments);
  ASSERT_EQ(done.exit_code, 0) << done.err << done.out;
  EXPECT_THAT(done.out, HasSubstr("13 of 13 views"));
  const std::vector<Camera> cameras = read_cameras(out);
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].id, "left");
  EXPECT_NEAR((camera_center(cameras[0]) - camera_center(cameras[1])).norm(), 0.083, 0.002);
  EXPECT_TRUE(fs::exists(out / "calibration.json"));
  const ChildResult again = calibrate(arguments);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err,
              HasSubstr("already exists, and no flag replaces it; choose another --out"));

  // The lenses that were found, given back, are kept to the bit; an image of another size is left
  // out and said.
  fs::copy(pictures, folder / "more", fs::copy_options::recursive);
  write_image(folder / "more" / "left99.png", ByteImage(32, 24, 3, 90));
  const ChildResult json =
      calibrate({(folder / "more").string(), "--out", (folder / "b").string(), "--board.square",
                 "0.025", "--lenses", (out / "cameras.json").string(), "--json"});
  ASSERT_EQ(json.exit_code, 0) << json.err;
  EXPECT_THAT(json.out, HasSubstr("\"schema\": \"atelier-calibration\""));
  EXPECT_THAT(json.out, HasSubstr("\"deviation\""));
  EXPECT_THAT(json.out, HasSubstr("32 x 24 pixels, and the first had 640 x 480"));
  EXPECT_THAT(json.out, HasSubstr("picture-sizes"));
  const std::vector<Camera> kept = read_cameras(folder / "b");
  EXPECT_EQ(kept[1].fx, cameras[1].fx);
  EXPECT_EQ(kept[1].distortion, cameras[1].distortion);
}

TEST(CalibrateCommand, WrongBoard_IsRefusedWithTheRightOne) {
  ATELIER_TEST_FILE(pictures, "opencv_stereo_chessboard");
  const TemporaryDirectory folder;
  const ChildResult wrong =
      calibrate({pictures.string(), "--out", (folder / "x").string(), "--board.columns", "9",
                 "--board.rows", "6", "--every", "5"});
  EXPECT_EQ(wrong.exit_code, 3);
  EXPECT_THAT(wrong.err, HasSubstr("a chessboard of 10 x 7 squares"));
  EXPECT_FALSE(fs::exists(folder / "x"));
}

// Board images that were not taken at one instant: lenses alone, and poses by a person's keypoints.
TEST(CalibrateCommand, RealTrialWithoutCommonBoard_IsPosedByKeypoints) {
  ATELIER_TEST_FILE(trial, "pose2sim_demo/single");
  const TemporaryDirectory folder;
  const std::string boards = (trial / "calibration/intrinsics").string();
  const std::vector<std::string> board = {"--board.columns", "8",   "--board.rows", "5",
                                          "--board.square",  "0.06"};
  const auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), board.begin(), board.end());
    return calibrate(arguments);
  };
  const ChildResult together = with({boards, "--out", (folder / "x").string()});
  EXPECT_EQ(together.exit_code, 3);
  EXPECT_THAT(together.err, HasSubstr("images of one number put the cameras somewhere else"));
  EXPECT_THAT(together.err, HasSubstr("--calibration.poses=false"));
  const ChildResult lenses =
      with({boards, "--out", (folder / "lenses").string(), "--calibration.poses=false"});
  ASSERT_EQ(lenses.exit_code, 0) << lenses.err;
  EXPECT_FALSE(fs::exists(folder / "lenses/cameras.json"));
  fs::create_directories(folder / "recording");
  fs::copy(trial / "videos", folder / "recording/videos");
  fs::copy(trial / "pose_openpose_body25b", folder / "recording/pose", fs::copy_options::recursive);
  const auto posed = [&](const std::string& out, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {(folder / "recording").string(), "--by-keypoints",
                                          "--out", (folder / out).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return calibrate(arguments);
  };
  const std::string file = (folder / "lenses/lenses.json").string();
  EXPECT_EQ(posed("y", {}).exit_code, 2);
  EXPECT_EQ(posed("y", {"--lenses", file}).exit_code, 2);
  const ChildResult shape = posed("y", {"--lenses", file, "--person.stature", "1.75"});
  EXPECT_EQ(shape.exit_code, 3);
  EXPECT_THAT(shape.err, HasSubstr("--lens-fit cropped, padded or stretched"));
  const ChildResult rig =
      posed("rig", {"--lenses", file, "--person.stature", "1.75", "--lens-fit", "padded"});
  ASSERT_EQ(rig.exit_code, 0) << rig.err << rig.out;
  const std::vector<Camera> cameras = read_cameras(folder / "rig");
  ASSERT_EQ(cameras.size(), 4U);
  for (const Camera& camera : cameras) {
    EXPECT_GT(camera_center(camera).y(), 1);  // as they hung: 1.5 to 2.7 m above the ground
    EXPECT_LT(camera_center(camera).y(), 3.2);
  }
}

TEST(CalibrateCommand, MissingImagesBoardOrPlace_AreRefused) {
  const TemporaryDirectory folder;
  fs::create_directories(folder / "empty");
  const ChildResult none =
      calibrate({(folder / "empty").string(), "--out", (folder / "x").string()});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("no images of a board"));
  const ChildResult nowhere =
      calibrate({(folder / "nowhere").string(), "--out", (folder / "x").string()});
  EXPECT_EQ(nowhere.exit_code, 3);
  EXPECT_THAT(nowhere.err, HasSubstr("nowhere: nothing is there"));
  EXPECT_EQ(calibrate({(folder / "empty").string()}).exit_code, 2);
  // Images of two sizes without a board.
  fs::create_directories(folder / "grey" / "a");
  write_image(folder / "grey" / "a" / "000001.png", ByteImage(64, 48, 3, 90));
  write_image(folder / "grey" / "a" / "000002.png", ByteImage(48, 64, 3, 90));
  const ChildResult grey =
      calibrate({(folder / "grey").string(), "--out", (folder / "x").string()});
  EXPECT_EQ(grey.exit_code, 3);
  EXPECT_THAT(grey.err, HasSubstr("no image shows the board"));
  EXPECT_EQ(calibrate({(folder / "grey").string(), "--out", (folder / "x").string(),
                       "--board.columns", "1"})
                .exit_code,
            2);
}

}  // namespace
}  // namespace atelier::fixtures

#endif
