// Advice on masks and turns is tried before it is given: it is never taken back once it is
// followed, and what is set wrongly is answered by taking it back, with figures.

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/layouts/open_dataset.h"
#include "capture/try_corrections.h"
#include "capture/validate.h"
#include "tests/capture/seeded_defects.h"
#include "tests/capture/small_capture.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

using Texts = std::map<std::string, std::string>;

/// As `atelier validate` does.
std::vector<Finding> judged_with(const fs::path& folder, const Texts& corrections) {
  const auto open = [&](const Texts& some) {
    DatasetOptions options;
    options.corrections = corrections_of(some);
    return open_dataset(folder, options);
  };
  FrameReader reader(without_wrong_corrections(open(corrections), open));
  return validate(reader).findings;
}

std::vector<Finding> of_code(const std::vector<Finding>& findings, const std::string& code) {
  std::vector<Finding> some;
  std::copy_if(findings.begin(), findings.end(), std::back_inserter(some),
               [&](const Finding& finding) { return finding.code == code; });
  return some;
}

/// Eight small cameras with masks, labels and detections.
SeededCapture capture_with_masks() {
  return seeded_capture(seeded_rigs()[0]);
}

void invert_mask_values(ByteImage& mask) {
  for (std::uint8_t& value : mask.data) {
    value = value != 0 ? 0 : 255;
  }
}

TEST(MaskAdvice, MasksOfATurnedCamera_AreNeverCalledInverted) {
  const TemporaryDirectory folder;
  SeededCapture capture = capture_with_masks();
  capture.labels.clear();
  std::for_each(capture.masks[4].begin(), capture.masks[4].end(),
                [](ByteImage& mask) { turn_upside_down(mask); });
  write_seeded(capture, folder.path());
  const std::vector<Finding> findings = judged_with(folder.path(), {});
  EXPECT_TRUE(of_code(findings, "mask-inverted").empty());
  const std::vector<Finding> turned = of_code(findings, "mask-turned");
  ASSERT_EQ(turned.size(), 1U);
  EXPECT_EQ(turned[0].place, "cam4");
  EXPECT_THAT(turned[0].what, HasSubstr("if it was turned by 180 degrees"));
  EXPECT_EQ(turned[0].setting, "") << "the images are not turned, as their detections show";
  // Whoever inverts them all the same is told to take that back.
  const auto again =
      of_code(judged_with(folder.path(), {{"masks", "cam4=inverted"}}), "mask-inverted");
  ASSERT_FALSE(again.empty());
  for (const Finding& finding : again) {
    EXPECT_EQ(finding.setting, "");
    EXPECT_THAT(finding.advice, HasSubstr("take --capture.masks cam4=inverted away"));
  }
}

TEST(MaskAdvice, CameraWithoutDetections_IsTurnedByItsMasks) {
  const TemporaryDirectory folder;
  SeededCapture capture = capture_with_masks();
  capture.labels.clear();
  for (auto* kind : {&capture.pictures, &capture.masks}) {
    std::for_each((*kind)[2].begin(), (*kind)[2].end(),
                  [](ByteImage& image) { turn_upside_down(image); });
  }
  write_seeded(capture, folder.path());
  fs::remove_all(folder.path() / "keypoints2d" / "cam2");
  const auto turned = of_code(judged_with(folder.path(), {}), "mask-turned");
  ASSERT_EQ(turned.size(), 1U);
  EXPECT_EQ(turned[0].setting, "--capture.turned cam2=180");
  const auto then = judged_with(folder.path(), {{"turned", "cam2=180"}});
  EXPECT_TRUE(of_code(then, "mask-turned").empty());
  EXPECT_TRUE(of_code(then, "mask-inverted").empty());
  EXPECT_TRUE(of_code(then, "correction-wrong").empty());
  // Of another turn on top, what both are together.
  const auto wrong =
      of_code(judged_with(folder.path(), {{"turned", "cam2=180,cam5=180"}}), "correction-wrong");
  ASSERT_EQ(wrong.size(), 1U);
  EXPECT_THAT(wrong[0].what, HasSubstr("--capture.turned cam5=180 makes it worse: of the "
                                       "detections"));
}

TEST(MaskAdvice, CloseView_IsNoInvertedMask) {
  const TemporaryDirectory folder;
  SeededCapture capture = capture_with_masks();
  capture.labels.clear();
  for (ByteImage& mask : capture.masks[1]) {  // of somebody whose clothes fill the rim
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        const bool rim = x < 8 || y < 6 || x >= mask.width - 8 || y >= mask.height - 6;
        const bool middle = x > 22 && x < 50;
        mask.at(x, y) = rim || middle ? 255 : mask.at(x, y);
      }
    }
  }
  write_seeded(capture, folder.path());
  EXPECT_TRUE(of_code(judged_with(folder.path(), {}), "mask-inverted").empty());
}

TEST(MaskAdvice, InversionOfSoundMasks_IsTakenBackWithFigures) {
  const TemporaryDirectory folder;
  write_seeded(capture_with_masks(), folder.path());
  for (const char* kept : {"joints and labels", "labels", "joints"}) {
    if (std::string(kept) == "labels") {
      fs::rename(folder.path() / "keypoints2d", folder.path() / "aside");
    } else if (std::string(kept) == "joints") {
      fs::rename(folder.path() / "aside", folder.path() / "keypoints2d");
      fs::remove_all(folder.path() / "labels");
    }
    EXPECT_TRUE(of_code(judged_with(folder.path(), {}), "mask-inverted").empty()) << kept;
    const auto findings =
        of_code(judged_with(folder.path(), {{"masks", "cam3=inverted"}}), "mask-inverted");
    ASSERT_FALSE(findings.empty()) << kept;
    for (const Finding& finding : findings) {
      EXPECT_EQ(finding.place.substr(0, 4), "cam3");
      EXPECT_EQ(finding.setting, "");
      EXPECT_THAT(finding.what, HasSubstr("%")) << "figures";
      EXPECT_THAT(finding.advice, HasSubstr("take --capture.masks cam3=inverted away"));
    }
  }
}

TEST(MaskAdvice, InvertedMasks_FitOnceTheAdviceIsFollowed) {
  const TemporaryDirectory folder;
  SeededCapture capture = capture_with_masks();
  std::for_each(capture.masks[3].begin(), capture.masks[3].end(), invert_mask_values);
  write_seeded(capture, folder.path());
  const auto findings = judged_with(folder.path(), {});
  EXPECT_THAT(settings_of(findings), ::testing::Contains("--capture.masks cam3=inverted"));
  EXPECT_TRUE(
      of_code(judged_with(folder.path(), {{"masks", "cam3=inverted"}}), "mask-inverted").empty());
}

TEST(MaskAdvice, MasksThatAreAllInverted_AreOneFindingThatNamesNoHeldOutCamera) {
  const TemporaryDirectory folder;
  SeededCapture capture = capture_with_masks();
  capture.labels.clear();
  capture.info.held_out_cameras = {"cam1", "cam5"};
  for (std::vector<ByteImage>& masks : capture.masks) {
    std::for_each(masks.begin(), masks.end(), invert_mask_values);
  }
  write_seeded(capture, folder.path());
  FrameReader reader(without_held_out_pictures(open_dataset(folder.path())));
  const std::vector<Finding> inverted = of_code(validate(reader).findings, "mask-inverted");
  ASSERT_EQ(inverted.size(), 1U);
  EXPECT_EQ(inverted[0].place, "all 6 cameras that are not held out");
  EXPECT_EQ(inverted[0].setting, "--capture.masks all=inverted");
}

TEST(MaskAdvice, MasksThatAreSetEverywhere_AreNotCalledInverted) {
  const TemporaryDirectory folder;
  SeededCapture capture = capture_with_masks();
  for (std::vector<ByteImage>& masks : capture.masks) {
    for (ByteImage& mask : masks) {
      std::fill(mask.data.begin(), mask.data.end(), std::uint8_t{255});
    }
  }
  write_seeded(capture, folder.path());
  const std::vector<Finding> findings = judged_with(folder.path(), {});
  EXPECT_TRUE(of_code(findings, "mask-inverted").empty());
  EXPECT_EQ(of_code(findings, "mask-full").size(), 1U);
  const std::vector<Finding> then = judged_with(folder.path(), {{"masks", "all=inverted"}});
  EXPECT_EQ(of_code(then, "mask-empty").size(), 1U);
  EXPECT_TRUE(of_code(then, "mask-disagrees").empty()) << "said once";
}

TEST(IdleCorrections, WhatChangesNothing_IsSaid) {
  const TemporaryDirectory folder;
  SmallCapture small;  // labels and no masks
  for (Camera& camera : small.cameras) {
    camera.distortion_model = Distortion::None;
    camera.distortion = {};
  }
  write_small_capture(folder.path(), small);
  for (const auto& [option, value] : {std::pair("masks", "all=inverted"),
                                      {"distortion", "all=negated"},
                                      {"distortion", "all=by_64"}}) {
    const auto idle = of_code(judged_with(folder.path(), {{option, value}}), "correction-idle");
    ASSERT_EQ(idle.size(), 1U) << option;
    EXPECT_THAT(idle[0].what,
                HasSubstr(std::string("--capture.") + option + " " + value + " changes nothing: "));
    EXPECT_EQ(idle[0].advice, "leave it out");
  }
  const TemporaryDirectory other;
  write_seeded(capture_with_masks(), other.path());
  EXPECT_TRUE(
      of_code(judged_with(other.path(), {{"masks", "cam3=inverted"}}), "correction-idle").empty());
}

}  // namespace
}  // namespace atelier::fixtures
