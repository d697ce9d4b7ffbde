// Images that are turned while keypoints and calibration are of the images as they are shown or as
// they are stored; sizes that are height, width; cameras without a pose in every layout; findings
// that all cameras share; advice that is followed at once.

#include <algorithm>
#include <functional>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/camera_conventions.h"
#include "capture/camera_readings.h"
#include "capture/join_alike.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "capture/try_corrections.h"
#include "capture/validate.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/usage_error.h"
#include "tests/capture/followed_advice.h"
#include "tests/capture/oriented_jpeg.h"
#include "tests/capture/seeded_capture.h"
#include "tests/capture/small_capture.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const Finding* with_code(const std::vector<Finding>& findings, const std::string& code) {
  const auto found = std::find_if(findings.begin(), findings.end(),
                                  [&](const Finding& finding) { return finding.code == code; });
  return found == findings.end() ? nullptr : &*found;
}

Keypoints2d turned_rows(Keypoints2d points, int quarters, double width, double height) {
  for (int i = 0; i < quarters; ++i) {
    for (Index k = 0; k < points.rows(); ++k) {
      if (!points.row(k).isZero(0)) {
        const double x = points(k, 0);
        points(k, 0) = height - points(k, 1);
        points(k, 1) = x;
      }
    }
    std::swap(width, height);
  }
  return points;
}

SeededRig upright_rig(int height = 800) {
  SeededRig rig;
  rig.circle = {.count = 4, .width = 600, .height = height, .focal = 900};
  rig.frames = 30;
  rig.pictures = false;
  return rig;
}

/// Images that EXIF shows otherwise than their files hold them, upright: they are stored turned by
/// so many quarters of how they are shown.
struct Lying {
  int stored = 3;
  char show_upright = 6;
  int height = 800;  ///< px, as shown; 600 wide
};
constexpr Lying kOnTheSide = {3, 6};

void write_lying(const fs::path& folder, bool calibrated_as_shown, bool detected_as_shown,
                 const Lying& lying = kOnTheSide) {
  SeededCapture capture = seeded_capture(upright_rig(lying.height));
  for (std::size_t c = 0; c < capture.cameras.size(); ++c) {
    const Camera shown = capture.cameras[c];
    if (!calibrated_as_shown) {
      capture.cameras[c] = turned_camera(shown, lying.stored);
    }
    for (Keypoints2d& rows : capture.keypoints[c]) {
      rows = detected_as_shown ? rows : turned_rows(rows, lying.stored, shown.width, shown.height);
    }
  }
  write_seeded(capture, folder);
  for (const Camera& camera : capture.cameras) {
    fs::create_directories(folder / "images" / camera.id);
    for (const int frame : capture.info.sequences.front().frame_ids) {
      const bool side = lying.stored % 2 != 0;
      write_oriented(folder / "images" / camera.id / (frame_name(frame) + ".jpg"),
                     side ? lying.height : 600, side ? 600 : lying.height, lying.show_upright);
    }
  }
}

class TurnedImages : public ::testing::TestWithParam<Lying> {};

TEST_P(TurnedImages, CalibrationAndKeypointsOfEither_AreRightOnceAdviceIsFollowed) {
  const Lying lying = GetParam();
  const SeededCapture sound = seeded_capture(upright_rig(lying.height));
  for (const bool calibrated : {true, false}) {
    for (const bool detected : {true, false}) {
      const TemporaryDirectory folder;
      write_lying(folder.path(), calibrated, detected, lying);
      const Followed result = follow(folder.path());
      const std::string what = std::string(calibrated ? "calibrated as shown" : "as stored") +
                               (detected ? ", detected as shown" : ", as stored") + "\n" +
                               all_lines(result.findings);
      EXPECT_EQ(result.corrections.contains("turned"), calibrated) << what;
      EXPECT_EQ(result.corrections.contains("keypoints"), detected) << what;
      EXPECT_FALSE(has_errors(result.findings)) << what;
      ASSERT_EQ(result.dataset.cameras.size(), sound.cameras.size()) << what;
      const Camera stored = turned_camera(sound.cameras[1], lying.stored);
      const Camera& read = result.dataset.cameras[1];
      EXPECT_LT((read.camera_from_world_rotation - stored.camera_from_world_rotation).norm(), 1e-6)
          << what;
      EXPECT_EQ(read.width, stored.width) << what;
      FrameReader reader(result.dataset);
      const int frame = sound.info.sequences.front().frame_ids[4];
      const Keypoints2d rows = reader.keypoints(1, frame).at(0).points;
      EXPECT_LT((rows - turned_rows(sound.keypoints[1][4], lying.stored, 600, lying.height))
                    .cwiseAbs()
                    .maxCoeff(),
                1e-3)
          << what;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Orientations, TurnedImages,
                         ::testing::Values(kOnTheSide, Lying{1, 8}, Lying{2, 3}, Lying{3, 6, 600},
                                           Lying{1, 8, 600}),
                         [](const auto& one) {
                           return std::to_string(one.param.show_upright) +
                                  (one.param.height == 600 ? "square" : "");
                         });

TEST(TurnOfNone, IsTaken_AndSilencesWhatExifSays) {
  const TemporaryDirectory folder;
  write_lying(folder.path(), false, false);
  EXPECT_NE(with_code(open_dataset(folder.path()).findings, "image-orientation"), nullptr);
  const Followed result = follow(folder.path(), {{"turned", "all=0"}});
  EXPECT_EQ(with_code(result.findings, "image-orientation"), nullptr) << all_lines(result.findings);
  EXPECT_EQ(with_code(result.findings, "correction-idle"), nullptr) << all_lines(result.findings);
  EXPECT_EQ(with_code(result.findings, "correction-wrong"), nullptr) << all_lines(result.findings);
}

TEST(UncalibratedImages, ExifBesideKeypoints_IsNamedUntilItIsSaid) {
  const TemporaryDirectory folder;
  write_lying(folder.path(), true, true);
  fs::remove(folder.path() / "cameras.json");
  fs::remove(folder.path() / "capture.toml");
  const auto opened = [&](const CorrectionSet& some) {
    DatasetOptions options;
    options.corrections = corrections_of(some);
    return open_dataset(folder.path(), options);
  };
  const Dataset dataset = opened({});
  ASSERT_FALSE(dataset.calibrated);
  const Finding* finding = with_code(dataset.findings, "image-orientation");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->severity, Severity::Warning);
  EXPECT_THAT(finding->advice, HasSubstr("=turned_90"));
  EXPECT_EQ(with_code(opened({{"turned", "all=0"}}).findings, "image-orientation"), nullptr);
  EXPECT_EQ(with_code(opened({{"keypoints", "all=turned_90"}}).findings, "image-orientation"),
            nullptr);
  fs::remove_all(folder.path() / "keypoints2d");
  const Dataset images = opened({});
  finding = with_code(images.findings, "image-orientation");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->severity, Severity::Note);
}

TEST(TurnedKeypoints, ReadingOfEachTurn_UndoesIt) {
  const KeypointSchema& schema = body_25_schema();
  Keypoints2d rows = Keypoints2d::Zero(25, 3);
  rows.row(2) << 100, 20, 0.9;
  rows.row(5) << 250.5, 470, 0.5;
  for (int quarters = 1; quarters < 4; ++quarters) {
    const std::string value = "turned_" + std::to_string(90 * quarters);
    const Keypoints2d back = read_as(turned_rows(rows, quarters, 640, 480),
                                     keypoint_reading(value, 640, 480), schema, 640, 480);
    EXPECT_LT((back - rows).cwiseAbs().maxCoeff(), 1e-9) << value;
  }
  ATELIER_EXPECT_REFUSED(keypoint_reading("turned_45", 640, 480), UsageError, "turned_90");
}

TEST(SwappedSize, HeightForWidth_IsToldByThePrincipalPoint) {
  const TemporaryDirectory folder;
  SmallCapture small;
  write_small_capture(folder / "capture", small);
  std::vector<Camera> cameras = small.cameras;
  for (Camera& camera : cameras) {
    std::swap(camera.width, camera.height);
  }
  write_file_atomically(folder / "capture" / "cameras.json", cameras_json(cameras));
  const Dataset dataset = open_dataset(folder / "capture");
  const Finding* finding = with_code(dataset.findings, "size-swapped");
  ASSERT_NE(finding, nullptr) << all_lines(dataset.findings);
  EXPECT_THAT(finding->what, HasSubstr("say 64 x 80, which is taken"));
  EXPECT_EQ(with_code(dataset.findings, "image-turned"), nullptr);
  EXPECT_EQ(dataset.cameras[0].width, 64);
  EXPECT_EQ(dataset.cameras[0].height, 80);
  // Of images that were turned since, the principal point is in the middle of the size that it
  // says.
  for (Camera& camera : cameras) {
    std::swap(camera.cx, camera.cy);
  }
  write_file_atomically(folder / "capture" / "cameras.json", cameras_json(cameras));
  const Dataset turned = open_dataset(folder / "capture");
  EXPECT_EQ(with_code(turned.findings, "size-swapped"), nullptr);
  EXPECT_NE(with_code(turned.findings, "image-turned"), nullptr);
}

/// Replaces what stands behind the first `key` of a text, up to `end`.
void replace_behind(const fs::path& path, const std::string& key, const std::string& end,
                    const std::string& by) {
  std::string text = read_file_text(path, 1 << 24);
  const std::size_t at = text.find(key);
  ASSERT_NE(at, std::string::npos) << path << " " << key;
  const std::size_t from = at + key.size();
  text.replace(from, text.find(end, from) - from, by);
  write_file_atomically(path, text);
}

struct Unposed {
  const char* layout;
  const char* file;
  const char* key;
  const char* end;
  const char* by;
};

class CameraWithoutPose : public ::testing::TestWithParam<Unposed> {};

TEST_P(CameraWithoutPose, OfOneCamera_LeavesItOutWithItsSetting) {
  const TemporaryDirectory folder;
  write_small_capture(folder / "capture");
  const fs::path written =
      write_layout(folder / "capture", GetParam().layout, folder / "out").folders.front();
  replace_behind(written / GetParam().file, GetParam().key, GetParam().end, GetParam().by);
  const Dataset dataset = open_dataset(written);
  EXPECT_EQ(dataset.layout, GetParam().layout);
  EXPECT_EQ(dataset.cameras.size(), 2U);
  const Finding* finding = with_code(dataset.findings, "camera-left-out");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->what, HasSubstr("no pose"));
  EXPECT_EQ(finding->setting, "--capture.leave-out " + finding->place);
  DatasetOptions options;
  options.corrections.leave_out = finding->place;
  const Dataset without = open_dataset(written, options);
  EXPECT_EQ(without.cameras.size(), 2U);
  EXPECT_EQ(with_code(without.findings, "camera-left-out"), nullptr);
}

INSTANTIATE_TEST_SUITE_P(
    Layouts, CameraWithoutPose,
    ::testing::Values(
        Unposed{"anipose", "calibration.toml", "rotation = ", "\n", "[]"},
        Unposed{"anipose", "calibration.toml", "rotation = ", "\n", "[nan, nan, nan]"},
        Unposed{"anipose", "calibration.toml", "translation = ", "\n", "[nan, 0.0, 0.0]"},
        Unposed{"anipose", "calibration.toml", "\nrotation", "\n", "_unknown = []"},
        Unposed{"pose2sim", "calibration/Calib.toml", "translation = ", "\n", "[inf, 0.0, 0.0]"},
        Unposed{"caliscope", "camera_array.toml", "rotation = ", "\n", "[]"},
        Unposed{"easymocap", "extri.yml", "T_01", ":", "_none"},
        Unposed{"actorshq", "1x/calibration.csv", "Cam001,64,80,", ",", "nan"},
        Unposed{"panoptic", "calibration_clothed.json", "\"R", "\"", "_none"},
        Unposed{"human36m", "camera-parameters.json", "\"t", "\"", "_none"},
        Unposed{"avatarrex", "calibration_full.json", "\"R", "\"", "_none"},
        Unposed{"thuman4", "calibration.json", "\"T", "\"", "_none"},
        Unposed{"mvhumannet", "camera_extrinsics.json", "\"rotation", "\"", "_none"},
        Unposed{"goliath", "camera_calibration.json", "\"T", "\"", "_none"}),
    [](const auto& one) {
      return std::string(one.param.layout) + "_" + std::to_string(one.index);
    });

TEST(CameraWithoutPose, NanInTransforms_LeavesItsCameraOut) {
  const TemporaryDirectory folder;
  write_small_capture(folder / "capture");
  const fs::path written =
      write_layout(folder / "capture", "nerfstudio", folder / "out").folders.front();
  std::string text = read_file_text(written / "transforms.json", 1 << 24);
  const std::string id = "\"images/" + std::string("00_");
  for (std::size_t at = 0; (at = text.find(id, at)) != std::string::npos; ++at) {
    const std::size_t matrix = text.find("\"transform_matrix\"", at);
    const std::size_t number = text.find_first_of("-0123456789", matrix);
    text.replace(number, text.find_first_of(",]", number) - number, "NaN");
  }
  write_file_atomically(written / "transforms.json", text);
  const Dataset dataset = open_dataset(written);
  EXPECT_EQ(dataset.cameras.size(), 2U);
  const Finding* finding = with_code(dataset.findings, "camera-left-out");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->setting, "--capture.leave-out 00");
}

TEST(JoinAlike, FindingOfEveryCamera_IsOneLine) {
  Dataset dataset;
  std::vector<Finding> findings;
  for (const std::string id : {"a1", "a2", "a3"}) {
    Camera camera;
    camera.id = id;
    dataset.cameras.push_back(camera);
    findings.push_back({Severity::Error, "image-turned", id, "images of " + id + " lie",
                        "say so of " + id, "--capture.turned " + id + "=90"});
    findings.push_back(
        {Severity::Error, "camera-off", id, "off", "leave it out", "--capture.leave-out " + id});
    findings.push_back({Severity::Warning, "camera-focal", id, "fx 12" + id.substr(1), "ask"});
  }
  findings.push_back({Severity::Error, "camera-moved", "a1", "moved", "calibrate again"});
  std::vector<Finding> joined = join_alike(findings, dataset);
  ASSERT_EQ(joined.size(), 4U) << all_lines(joined);
  EXPECT_EQ(joined[0].place, "all 3 cameras");
  EXPECT_EQ(joined[0].what, "images of all lie");
  EXPECT_EQ(joined[0].setting, "--capture.turned all=90");
  EXPECT_EQ(joined[1].setting, "");
  EXPECT_EQ(joined[2].what, "a1: fx 121; the others alike");
  EXPECT_EQ(joined[3].place, "a1");
  findings.erase(findings.begin());
  joined = join_alike(findings, dataset);
  EXPECT_EQ(joined.size(), 5U) << all_lines(joined);
}

TEST(Advice, CameraThatIsLeftOut_MayLendItsCalibration) {
  const TemporaryDirectory folder;
  SmallCapture small;
  write_small_capture(folder / "capture", small);
  DatasetOptions options;
  options.corrections.leave_out = "02";
  options.corrections.calibration_of = "01=02";
  const Dataset dataset = open_dataset(folder / "capture", options);
  ASSERT_EQ(dataset.cameras.size(), 2U);
  EXPECT_EQ(dataset.cameras[1].id, "01");
  EXPECT_EQ(dataset.cameras[1].camera_from_world_translation,
            small.cameras[2].camera_from_world_translation);
}

TEST(Advice, SettingsThatDoNotGoTogether_AreNotAdvisedAtOnce) {
  const TemporaryDirectory folder;
  write_small_capture(folder / "capture");
  const auto open = [&](const CorrectionSet& some) {
    DatasetOptions options;
    options.corrections = corrections_of(some);
    return open_dataset(folder / "capture", options);
  };
  const std::vector<Finding> findings = {
      {Severity::Error, "camera-off", "00", "off", "leave it out", "--capture.leave-out 00"},
      {Severity::Error, "camera-off", "01", "off", "leave it out", "--capture.leave-out 01"},
      {Severity::Error, "camera-off", "02", "off", "leave it out", "--capture.leave-out 02"}};
  const std::vector<Finding> kept = with_advice_that_joins(findings, open({}), open);
  EXPECT_EQ(settings_of(kept), std::vector<std::string>{"--capture.leave-out 00,01"});
  EXPECT_THAT(kept[2].advice, HasSubstr("not beside the other settings"));
}

}  // namespace
}  // namespace atelier::fixtures
