// Corrections that a user gives wrongly are named, and nothing else is blamed; right ones stay.

#include "capture/try_corrections.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/layouts/open_dataset.h"
#include "capture/validate.h"
#include "core/io/image_file.h"
#include "tests/capture/followed_advice.h"
#include "tests/capture/oriented_jpeg.h"
#include "tests/capture/seeded_defects.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// Of an option as it is typed: "sync" and "cam2=3" of "--capture.sync cam2=3".
std::map<std::string, std::string> correction_in(const std::string& setting) {
  const std::size_t begin = std::string("--capture.").size();
  const std::size_t space = setting.find(' ');
  std::string option = setting.substr(begin, space - begin);
  std::replace(option.begin(), option.end(), '-', '_');
  return {{option, setting.substr(space + 1)}};
}

Dataset judged(const fs::path& folder, const std::map<std::string, std::string>& corrections) {
  const auto open = [&](const std::map<std::string, std::string>& some) {
    DatasetOptions options;
    options.corrections = corrections_of(some);
    return open_dataset(folder, options);
  };
  return without_wrong_corrections(open(corrections), open);
}

std::string wrong_in(const Dataset& dataset) {
  std::string text;
  for (const Finding& finding : dataset.findings) {
    text += finding.code == "correction-wrong" ? to_string(finding) + "\n" : "";
  }
  return text;
}

SeededRig rig_of_detections() {
  SeededRig rig;
  rig.circle = {.count = 4, .width = 800, .height = 600, .focal = 700};
  rig.frames = 30;
  rig.pictures = false;
  return rig;
}

class WrongCorrection : public ::testing::TestWithParam<std::string> {};

TEST_P(WrongCorrection, OfASoundCapture_IsToBeLeftOut) {
  const TemporaryDirectory folder;
  write_seeded(seeded_capture(rig_of_detections()), folder.path());
  const Dataset dataset = judged(folder.path(), correction_in(GetParam()));
  EXPECT_THAT(wrong_in(dataset), HasSubstr(GetParam() + " makes it worse"));
  EXPECT_THAT(wrong_in(dataset), HasSubstr("leave it out"));
  EXPECT_TRUE(dataset.corrections.empty());
  FrameReader reader(dataset);
  for (const Finding& finding : validate(reader).findings) {
    EXPECT_TRUE(finding.severity != Severity::Error || finding.code == "correction-wrong" ||
                finding.code == "camera-without-pictures")
        << to_string(finding);
  }
}

INSTANTIATE_TEST_SUITE_P(
    EachOption, WrongCorrection,
    ::testing::Values("--capture.sync cam1=3", "--capture.intrinsics cam1=0.5",
                      "--capture.intrinsics all=2", "--capture.intrinsics cam2=swapped_centre",
                      "--capture.baseline cam1=0.1", "--capture.baseline cam3=1000",
                      "--capture.pixel-shift cam1=40", "--capture.pixel-shift all=-60",
                      "--capture.extrinsics all=inverse", "--capture.extrinsics cam2=position",
                      "--capture.calibration-of cam1=cam2", "--capture.keypoints cam1=mirrored",
                      "--capture.keypoints all=0.5", "--capture.turned cam1=180"));

/// Wrong readings of lenses are small beside wrong poses: the error tells of them, and by how much.
TEST(TryCorrections, WrongReadingOfDistortion_IsToldByTheError) {
  const TemporaryDirectory folder;
  write_seeded(seeded_capture(seeded_rigs()[2]), folder.path());
  EXPECT_EQ(wrong_in(judged(folder.path(), {})), "");
  for (const std::string set : {"all=negated", "all=by_64", "all=none", "all=times_64"}) {
    const std::string wrong = wrong_in(judged(folder.path(), {{"distortion", set}}));
    EXPECT_THAT(wrong, HasSubstr("--capture.distortion " + set +
                                 " makes it worse: of the "
                                 "detections"));
    EXPECT_THAT(wrong, HasSubstr(" px of error")) << set;
    EXPECT_THAT(wrong, HasSubstr("leave it out")) << set;
  }
}

TEST(TryCorrections, WrongOneAmongRightOnes_IsToldApart) {
  const TemporaryDirectory folder;
  SeededCapture capture = seeded_capture(rig_of_detections());
  capture.keypoints[2] = seeded_detections(rig_of_detections(), capture.cameras[2], 2, -4);
  write_seeded(capture, folder.path());
  const Dataset dataset =
      judged(folder.path(), {{"sync", "cam1=3,cam2=-4"}, {"baseline", "cam0=0.5"}});
  EXPECT_THAT(wrong_in(dataset), HasSubstr("--capture.sync cam1=3 makes it worse"));
  EXPECT_THAT(wrong_in(dataset), HasSubstr("leave it out, and give --capture.sync cam2=-4 alone"));
  EXPECT_THAT(wrong_in(dataset), HasSubstr("--capture.baseline cam0=0.5 makes it worse"));
  EXPECT_EQ(dataset.corrections, (std::map<std::string, std::string>{{"sync", "cam2=-4"}}));
}

TEST(TryCorrections, RightCorrectionsOfSeededDefects_Stay) {
  for (const SeededDefect& defect : all_defects()) {
    const std::string setting = defect.setting;
    const bool corrects = setting.find('=') != std::string::npos;  // not a unit, a layout
    if (!corrects) {
      continue;
    }
    const TemporaryDirectory folder;
    const SeededRig rig = seeded_rigs()[static_cast<std::size_t>(defect.rig)];
    write_spoiled(defect, {rig, seeded_capture(rig), folder.path()});
    EXPECT_EQ(wrong_in(judged(folder.path(), correction_in(setting))), "") << defect.what;
  }
}

TEST(TryCorrections, TurnOfImagesThatAreNotTurned_IsToBeLeftOut) {
  const TemporaryDirectory folder;
  SeededRig rig;
  rig.circle = {.count = 4, .width = 80, .height = 100, .focal = 125};
  rig.frames = 3;
  write_seeded(seeded_capture(rig), folder.path());
  for (const std::string set : {"cam1=90", "all=90", "cam0=180,cam1=270"}) {
    DatasetOptions options;
    options.corrections.turned = set;
    for (const Finding& finding : open_dataset(folder.path(), options).findings) {
      EXPECT_EQ(finding.setting, "") << to_string(finding);
      EXPECT_EQ(finding.code == "image-turned", finding.severity == Severity::Error);
    }
    const std::string wrong = wrong_in(judged(folder.path(), {{"turned", set}}));
    EXPECT_THAT(
        wrong, HasSubstr("--capture.turned " + set.substr(set.rfind(',') + 1) + " makes it worse"));
    EXPECT_THAT(wrong, HasSubstr("leave it out")) << set;
  }
}

TEST(TryCorrections, CaptureWithoutDetections_IsJudgedByItsCameras) {
  const TemporaryDirectory folder;
  write_seeded(seeded_capture(rig_of_detections()), folder.path());
  fs::remove_all(folder.path() / "keypoints2d");
  EXPECT_THAT(wrong_in(judged(folder.path(), {{"extrinsics", "all=inverse"}})),
              HasSubstr(" with it, without it none"));
  EXPECT_EQ(wrong_in(judged(folder.path(), {{"distortion", "all=none"}})), "");
}

SeededRig rig_of_lenses() {
  SeededRig rig = rig_of_detections();
  rig.circle = {.count = 6, .width = 800, .height = 600, .focal = 700};
  rig.distortion = {-0.2, 0.06, 0, 0, 0};
  return rig;
}

// One lens that is broken is not answered by taking all others away.
TEST(LensAdvice, OneBrokenLens_IsAdvisedForThatCameraAlone) {
  const TemporaryDirectory folder;
  SeededCapture capture = seeded_capture(rig_of_lenses());
  capture.cameras[2].distortion[0] = 1e9;
  write_seeded(capture, folder.path());
  const Followed followed = follow(folder.path());
  const auto set = followed.corrections.find("distortion");
  ASSERT_NE(set, followed.corrections.end()) << all_lines(followed.findings);
  EXPECT_EQ(set->second, capture.cameras[2].id + "=none");
  for (const Finding& finding : followed.findings) {
    EXPECT_NE(finding.severity, Severity::Error) << to_string(finding);
  }
}

TEST(LensAdvice, TwoBrokenLenses_AreAdvisedTogether) {
  const TemporaryDirectory folder;
  SeededCapture capture = seeded_capture(rig_of_lenses());
  capture.cameras[1].distortion[0] = 1e9;
  capture.cameras[4].distortion[1] = -1e6;
  write_seeded(capture, folder.path());
  const Followed followed = follow(folder.path());
  const auto set = followed.corrections.find("distortion");
  ASSERT_NE(set, followed.corrections.end()) << all_lines(followed.findings);
  EXPECT_THAT(set->second, ::testing::AnyOf("cam1=none,cam4=none", "cam4=none,cam1=none"));
}

TEST(LensAdvice, ReadingOfAllLenses_StaysThatOfAll) {
  const TemporaryDirectory folder;
  SeededCapture capture = seeded_capture(rig_of_lenses());
  for (Camera& camera : capture.cameras) {
    camera.distortion[0] *= 64;
    camera.distortion[1] *= 64;
  }
  write_seeded(capture, folder.path());
  const Followed followed = follow(folder.path());
  const auto set = followed.corrections.find("distortion");
  ASSERT_NE(set, followed.corrections.end()) << all_lines(followed.findings);
  EXPECT_THAT(set->second, ::testing::StartsWith("all="));
}

/// The seeded capture with images of an EXIF orientation.
void write_with_orientation(const SeededCapture& capture, char orientation,
                            const fs::path& folder) {
  write_seeded(capture, folder);
  std::vector<fs::path> images;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "images")) {
    if (entry.is_regular_file()) {
      images.push_back(entry.path());
    }
  }
  for (const fs::path& image : images) {
    const ByteImage stored = read_byte_image(image);
    fs::remove(image);
    write_oriented(fs::path(image).replace_extension(".jpg"), stored, orientation);
  }
}

// Programs that turn pixels upright and keep the EXIF leave such images.
TEST(ExifAdvice, OrientationOfImagesThatAreUpright_IsAnsweredByNoTurn) {
  SeededCapture capture = seeded_capture(seeded_rigs()[0]);
  capture.labels.clear();
  for (const bool masks : {true, false}) {
    SCOPED_TRACE(masks);
    const TemporaryDirectory folder;
    if (!masks) {
      capture.masks.clear();
    }
    write_with_orientation(capture, 3, folder.path());
    const Followed followed = follow(folder.path());
    EXPECT_EQ(followed.corrections, (CorrectionSet{{"turned", "all=0"}}))
        << all_lines(followed.findings);
    for (const Finding& finding : followed.findings) {
      EXPECT_NE(finding.severity, Severity::Error) << to_string(finding);
    }
  }
}

}  // namespace
}  // namespace atelier::fixtures
