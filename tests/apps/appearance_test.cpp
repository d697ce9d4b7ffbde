// The stages `appearance` and `oracle`, from images to networks and figures.
#if defined(ATELIER_HAS_CAPTURE)

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/device.h"
#include "core/io/image_file.h"
#include "tests/apps/appearance_fixture.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

TEST_F(Appearance, HeldOutCamera_IsExcludedFromTrainingAndMeasured) {
  const ChildResult done = oracle("ws");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, MatchesRegex("(.|\n)*oracle  24/24 steps  [^\n]*/s  [^\n]* left  "
                                     "loss [0-9.e-]+  psnr_db [0-9.]+\n(.|\n)*"));
  // Three images of the training, each beside what is drawn of it.
  const ByteImage pairs = read_byte_image(folder_ / "ws" / "oracle" / "current" / "pictures.png");
  EXPECT_GE(pairs.width, 6 * 300);
  EXPECT_GE(pairs.height, 300);
  EXPECT_GT(std::set<std::uint8_t>(pairs.data.begin(), pairs.data.end()).size(), 50U);
  const ChildResult figures = run_child({program_path(), "evaluate", (folder_ / "ws").string(),
                                         "--ground-truth", capture_.string(), "--stage", "oracle"});
  ASSERT_THAT(figures.exit_code, ::testing::AnyOf(0, 1)) << figures.err;
  for (const char* key : {"oracle.psnr_db", "oracle.gain_db", "oracle.shadow_psnr_db",
                          "oracle.shadow_ssim", "oracle.ssim", "oracle.covered"}) {
    EXPECT_THAT(figures.out, HasSubstr(key));
  }
  EXPECT_THAT(figures.out, HasSubstr("; small: 32 texels, 24 steps"));
  // Without the images that are held out: the same network, bit for bit.
  for (int c = 0; c < kCameras; ++c) {
    for (int f = 0; f < kFrames; ++f) {
      if (c == kCameras - 1 || f == kFrames - 1) {
        fs::remove(capture_ / "images" / ("0" + std::to_string(c)) / (digits(f) + ".png"));
        fs::remove(capture_ / "labels" / ("0" + std::to_string(c)) / (digits(f) + ".png"));
      }
    }
  }
  fs::remove_all(capture_ / "truth" / "images");
  const ChildResult again = oracle("without");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(bytes_of(result("without", "model.safetensors")),
            bytes_of(result("ws", "model.safetensors")));
}

TEST_F(Appearance, AppearanceBelowOracle_IsCostOfRegistration) {
  const fs::path workspace = found();
  ASSERT_EQ(appearance(workspace).exit_code, 0);
  const auto figures = [&](const std::string& stage) {
    const ChildResult result =
        run_child({program_path(), "evaluate", workspace.string(), "--ground-truth",
                   capture_.string(), "--stage", stage, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out);
  };
  EXPECT_FALSE(figures("appearance").contains("appearance.below_oracle_db")) << "no oracle yet";
  ASSERT_EQ(oracle("found").exit_code, 0);
  const nlohmann::json both = figures("appearance");
  const nlohmann::json alone = figures("oracle");
  EXPECT_EQ(alone.at("oracle.psnr_db"), both.at("oracle.psnr_db"));
  EXPECT_FALSE(alone.contains("appearance.psnr_db"));
  const double oracle_db = both.at("oracle.psnr_db");
  const double reached_db = both.at("appearance.psnr_db");
  EXPECT_GT(oracle_db, 10);
  EXPECT_GT(reached_db, 10);
  EXPECT_NEAR(both.at("appearance.below_oracle_db"), oracle_db - reached_db, 1e-9);
  EXPECT_NEAR(oracle_db, reached_db, 1.5) << "what was found is the ground truth";
  // Another network than the oracle's: what lies between them is not what registration costs.
  const auto text = [&] {
    return run_child({program_path(), "evaluate", workspace.string(), "--ground-truth",
                      capture_.string(), "--stage", "appearance"})
        .out;
  };
  EXPECT_THAT(text(), HasSubstr("below the same network on ground-truth geometry"));
  ASSERT_EQ(oracle("found", {"--channels", "3"}).exit_code, 0);
  EXPECT_THAT(text(),
              HasSubstr("below another network on ground-truth geometry: channels 2 and 3"));
  EXPECT_FALSE(figures("appearance").at("appearance.psnr_db").is_null());
}

TEST_F(Appearance, ImagesContradictingGeometry_AreRefused) {
  const fs::path labels = capture_ / "labels";
  for (const auto& entry : fs::recursive_directory_iterator(labels)) {
    if (entry.is_regular_file()) {
      write_labels(entry.path(), ByteImage(kSide, kSide, 1, 1));
    }
  }
  const ChildResult refused = oracle("ws");
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("of one capture"));
}

TEST_F(Appearance, CameraWithShiftedLabels_IsNamed) {
  ChildResult done = oracle("ws");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, Not(HasSubstr("label images of camera")));
  // Labels of one camera that have a third of the garment.
  for (const auto& entry : fs::directory_iterator(capture_ / "labels" / "02")) {
    ByteImage labels = read_labels(entry.path());
    for (int y = 0; y < labels.height; ++y) {
      for (int x = labels.width / 3; x < labels.width; ++x) {
        labels.at(x, y) = 0;
      }
    }
    write_labels(entry.path(), labels);
  }
  done = oracle("strange");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("label images of camera 02 have the garment in only"));
  EXPECT_THAT(done.err, Not(HasSubstr("label images of camera 01")));
}

TEST_F(Appearance, ContradictingCameras_AreNamedWithoutLabels) {
  give_pictures({});
  ChildResult done = oracle("ws");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, Not(HasSubstr("contradict")));
  give_pictures({{0, 3}, {3, 0}});
  done = oracle("exchanged");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("images of camera 00 contradict the geometry"));
  EXPECT_THAT(done.err, HasSubstr("images of camera 03 contradict the geometry"));
  for (const char* right : {"01", "02", "04", "05", "06", "07", "08"}) {
    EXPECT_THAT(done.err, Not(HasSubstr(std::string("images of camera ") + right)));
  }
}

TEST_F(Appearance, MostImagesContradicting_IsRefusedWithoutLabels) {
  give_pictures({{0, 8}, {1, 7}, {2, 6}, {3, 5}, {5, 3}, {6, 2}, {7, 1}, {8, 0}});
  const ChildResult refused = oracle("ws");
  EXPECT_EQ(refused.exit_code, 3) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("of one capture"));
}

TEST_F(Appearance, CameraWithoutImages_IsNamed) {
  fs::remove_all(capture_ / "images" / "01");
  fs::remove(capture_ / "images" / "03" / "000000.png");
  const ChildResult done = oracle("ws");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("camera 01 has no image of 3 of 3 frames"));
  EXPECT_THAT(done.err, HasSubstr("camera 03 has no image of 1 of 3 frames"));
  EXPECT_THAT(done.err, Not(HasSubstr("camera 09")));  // it is held out
}

TEST_F(Appearance, OutdatedInputs_AreWarnedOfBeforeTheyAreRead) {
  const fs::path workspace = found();
  EXPECT_THAT(appearance(workspace, {"--dry-run"}).out, Not(HasSubstr("outdated")));
  fs::copy(capture_, folder_ / "other", fs::copy_options::recursive);
  fs::remove(capture_ / "images" / "03" / "000002.png");
  const std::string warning =
      "warning: the result of 'register' is outdated: input capture changed";
  const std::string command =
      "run 'atelier register " + capture_.string() + " " + workspace.string() + "' to recompute it";
  EXPECT_THAT(appearance(workspace, {"--dry-run"}).out,
              AllOf(HasSubstr(warning), HasSubstr(command)));
  const ChildResult done = appearance(workspace);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr(warning));
  EXPECT_LT(done.err.find(warning), done.err.find("camera 03 has no image")) << done.err;
  const ChildResult drawn =
      run_child({program_path(), "render", "--neural", workspace.string(), "--out",
                 (folder_ / "drawn").string(), "--width", "32", "--height", "32"});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_THAT(drawn.out, HasSubstr("warning: the result of 'appearance' is outdated: "));
  // What was moved and has changed is the same capture; of another one is said what differs.
  fs::remove(folder_ / "other" / "images" / "03" / "000002.png");
  fs::remove(folder_ / "other" / "images" / "03" / "000001.png");
  EXPECT_EQ(learn("appearance", folder_ / "other", workspace, {"--dry-run"}).exit_code, 0);
  for (const fs::directory_entry& file : fs::recursive_directory_iterator(folder_ / "other")) {
    if (file.is_regular_file()) {
      std::ofstream(file.path(), std::ios::app) << "\n";
    }
  }
  const ChildResult other = learn("appearance", folder_ / "other", workspace, {"--dry-run"});
  EXPECT_EQ(other.exit_code, 2);
  // The line at the end of capture.toml is in its consent, which is no content: that file is here.
  EXPECT_THAT(other.err,
              MatchesRegex("(.|\n)*results of another capture, .*: [0-9]+ files, [0-9]+ bytes "
                           "there, [0-9]+ files, [0-9]+ bytes here; of [0-9]+ files there that "
                           "were compared 1 is here; (.|\n)*"));
}

TEST_F(Appearance, StageWithoutResult_HasNoFigures) {
  const fs::path workspace = found();
  const std::vector<std::string> words = {program_path(),   "evaluate",        workspace.string(),
                                          "--ground-truth", capture_.string(), "--stage",
                                          "oracle"};
  const ChildResult plain = run_child(words);
  EXPECT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_THAT(plain.out, HasSubstr("there is no result of oracle; run 'atelier oracle' first"));
  std::vector<std::string> checked = words;
  checked.emplace_back("--check");
  const ChildResult check = run_child(checked);
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_THAT(check.err, HasSubstr("no figure of 'oracle' was measured"));
}

TEST_F(Appearance, UnknownCameras_AreRefusedByADryRunToo) {
  for (const char* flag : {"--dry-run", "--force"}) {
    const ChildResult refused = oracle("ws", {"--capture.leave-out", "99", flag});
    EXPECT_EQ(refused.exit_code, 2) << flag;
    EXPECT_THAT(refused.err, HasSubstr("99")) << flag;
  }
}

TEST_F(Appearance, OptionsNoNetworkCanHave_AreRefusedAtOnce) {
  ChildResult refused = oracle("ws", {"--resolution", "100"});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("resolution cannot be 100: it takes powers of 2"));
  EXPECT_THAT(refused.err, HasSubstr("as 64 or 128"));
  refused = oracle("ws", {"--resolution", "4096"});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("2048"));
  refused = oracle("ws", {"--resolution", "32", "--shading", "16"});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("leaves branches of 2 texels a side; 8 are the fewest"));
  refused = oracle(
      "ws", {"--view-independent", "false", "--view-dependent", "false", "--pixel-bias", "true"});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("--pixel-bias is of the branches"));
  refused = oracle("ws", {"--shading", "3"});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_THAT(refused.err,
              HasSubstr("shading cannot be 3: it takes powers of 2 from 1 to 16, as 2 or 4"));
  for (const char* when : {"now", "--dry-run"}) {
    std::vector<std::string> half = {"--half", "true"};
    if (when != std::string("now")) {
      half.emplace_back(when);
    }
    refused = oracle("ws", half);
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr("--half works on a GPU alone")) << when;
  }
  expect_nothing_of_oracle("ws");
  if (!cuda_available()) {
    refused = oracle("ws", {"--device", "cuda"});
    EXPECT_EQ(refused.exit_code, 5) << refused.err;
    expect_nothing_of_oracle("ws");
  }
}

TEST_F(Appearance, DivergedTraining_GivesNoResult) {
  const ChildResult diverged = oracle("ws", {"--learning-rate", "1"});
  EXPECT_EQ(diverged.exit_code, 4) << diverged.err;
  EXPECT_THAT(diverged.err, HasSubstr("below the"));
  EXPECT_THAT(diverged.err, HasSubstr("a smaller --learning-rate may help"));
  EXPECT_FALSE(fs::exists(folder_ / "ws" / "oracle" / "current"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
