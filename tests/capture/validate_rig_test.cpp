// What validate finds of a rig as a whole, what it advises beside what is set, and cameras of every
// turn and of huge numbers, on which nothing may break.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/camera_conventions.h"
#include "capture/check_cameras.h"
#include "capture/check_keypoints.h"
#include "capture/check_labels.h"
#include "capture/layouts/open_dataset.h"
#include "capture/sentence.h"
#include "capture/settle_advice.h"
#include "capture/validate.h"
#include "core/usage_error.h"
#include "tests/capture/seeded_capture.h"
#include "tests/capture/small_capture.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const Finding* finding_named(const std::vector<Finding>& findings, const std::string& code) {
  const auto found = std::find_if(findings.begin(), findings.end(),
                                  [&](const Finding& finding) { return finding.code == code; });
  return found == findings.end() ? nullptr : &*found;
}

std::vector<Finding> validated(const fs::path& folder, const DatasetOptions& options = {}) {
  FrameReader reader(open_dataset(folder, options));
  return validate(reader).findings;
}

/// A small native capture whose capture.toml is changed.
class SmallRig : public ::testing::Test {
 protected:
  void write(const SmallCapture& small = {}) { write_small_capture(capture(), small); }
  void set_info(const std::function<void(CaptureInfo&)>& change) {
    CaptureInfo info = read_capture_info(capture());
    change(info);
    write_file_atomically(capture() / "capture.toml", capture_toml(info));
  }
  fs::path capture() const { return folder_ / "capture"; }
  TemporaryDirectory folder_;
};

TEST_F(SmallRig, OneCameraAlone_IsAnError) {
  SmallCapture small;
  small.cameras.resize(1);
  write(small);
  const auto findings = validated(capture());
  const Finding* finding = finding_named(findings, "cameras-few");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->severity, Severity::Error);
  EXPECT_THAT(finding->what, HasSubstr("one camera alone"));
}

TEST_F(SmallRig, HeldOutFrames_MustLeaveSome) {
  write();
  set_info([](CaptureInfo& info) {
    for (const CaptureSequence& sequence : info.sequences) {
      info.held_out_frames.insert(info.held_out_frames.end(), sequence.frame_ids.begin(),
                                  sequence.frame_ids.end());
    }
  });
  ASSERT_NE(finding_named(validated(capture()), "frames-held-out"), nullptr);
}

TEST_F(SmallRig, HeldOutFrames_LeaveSomeOfEverySequence) {
  write();
  set_info([](CaptureInfo& info) {
    CaptureSequence other = info.sequences.front();
    other.name = "other";
    other.frame_ids = {info.sequences.front().frame_ids.back()};
    info.sequences.front().frame_ids.pop_back();
    info.held_out_frames = other.frame_ids;
    info.sequences.push_back(std::move(other));
  });
  const auto findings = validated(capture());
  EXPECT_EQ(finding_named(findings, "frames-held-out"), nullptr);
  const Finding* finding = finding_named(findings, "sequence-held-out");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->what, HasSubstr("the sequence other"));
}

TEST_F(SmallRig, CamerasThatCountTheirOwnFrames_AreToldWithTheShift) {
  write();
  for (const int camera : {1, 2}) {
    std::vector<fs::path> files;
    for (const auto& entry :
         fs::directory_iterator(capture() / "images" / ("0" + std::to_string(camera)))) {
      files.push_back(entry.path());
    }
    for (const fs::path& file : files) {
      const int number = std::stoi(file.stem().string()) + 100 * camera;
      fs::rename(file, file.parent_path() / sentence("%06d.png", number));
    }
  }
  const auto findings = validated(capture());
  const Finding* finding = finding_named(findings, "frames-apart");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->severity, Severity::Error);
  EXPECT_EQ(finding->setting, "--capture.sync 01=-100,02=-200");
}

TEST_F(SmallRig, HeldOutCameras_MustExistAndLeaveSome) {
  write();
  set_info([](CaptureInfo& info) { info.held_out_cameras = {"00", "01", "02"}; });
  auto findings = validated(capture());
  ASSERT_NE(finding_named(findings, "cameras-held-out"), nullptr);
  set_info([](CaptureInfo& info) { info.held_out_cameras = {"00", "01"}; });
  findings = validated(capture());
  ASSERT_NE(finding_named(findings, "cameras-few"), nullptr);
  set_info([](CaptureInfo& info) { info.held_out_cameras = {"0", "cam1"}; });
  findings = validated(capture());
  const Finding* finding = finding_named(findings, "held-out-unknown");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->what, HasSubstr("0, cam1"));
  set_info([](CaptureInfo& info) { info.held_out_cameras = {"00"}; });
  findings = validated(capture());
  EXPECT_EQ(finding_named(findings, "held-out-unknown"), nullptr);
  EXPECT_EQ(finding_named(findings, "cameras-few"), nullptr);
}

TEST_F(SmallRig, FrameRateOfNoRecording_IsAnError) {
  write();
  set_info([](CaptureInfo& info) { info.sequences.front().fps = 1e-9; });
  const auto findings = validated(capture());
  const Finding* finding = finding_named(findings, "fps-odd");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->what, HasSubstr("1e-09"));
  DatasetOptions options;
  options.fps = 30;
  EXPECT_EQ(finding_named(validated(capture(), options), "fps-odd"), nullptr);
}

TEST_F(SmallRig, CamerasWithoutPictures_AreOneFindingWithASetting) {
  SmallCapture small;
  small.cameras =
      dome_cameras({.cameras = 6, .pairs = false, .width = 64, .height = 80, .gain = 0}, {1, 1});
  write(small);
  for (const char* id : {"03", "05"}) {
    fs::remove_all(capture() / "images" / id);
  }
  auto findings = validated(capture());
  const Finding* finding = finding_named(findings, "camera-without-pictures");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->setting, "--capture.leave-out 03,05");
  EXPECT_THAT(settings_of(findings), ::testing::Contains("--capture.leave-out 03,05"));
  DatasetOptions options;
  options.corrections.leave_out = "03,05";
  EXPECT_EQ(finding_named(validated(capture(), options), "camera-without-pictures"), nullptr);
}

TEST_F(SmallRig, CaptureWithoutImageAndDetection_IsAnError) {
  write();
  for (const char* part : {"images", "labels", "keypoints2d"}) {
    fs::remove_all(capture() / part);
  }
  const auto findings = validated(capture());
  const Finding* finding = finding_named(findings, "no-frames");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->severity, Severity::Error);
}

TEST_F(SmallRig, ImagesAlone_AreToldWithWhatFindsPeople) {
  write();
  EXPECT_EQ(finding_named(validated(capture()), "images-alone"), nullptr);
  for (const char* kind : {"keypoints2d", "masks"}) {
    fs::remove_all(capture() / kind);
  }
  EXPECT_EQ(finding_named(validated(capture()), "images-alone"), nullptr) << "labels are left";
  // Labels of one camera alone are no masks of two.
  SmallCapture small;
  for (std::size_t c = 1; c < small.cameras.size(); ++c) {
    fs::remove_all(capture() / "labels" / small.cameras[c].id);
  }
  std::vector<Finding> findings = validated(capture());
  ASSERT_NE(finding_named(findings, "images-alone"), nullptr);
  EXPECT_THAT(finding_named(findings, "images-alone")->what,
              HasSubstr("no frame has masks or labels of two cameras"));
  fs::remove_all(capture() / "labels");
  findings = validated(capture());
  const Finding* finding = finding_named(findings, "images-alone");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->severity, Severity::Warning);
  EXPECT_THAT(finding->what, HasSubstr("every stage but validate is skipped"));
  EXPECT_THAT(finding->advice, HasSubstr("atelier detect"));
  EXPECT_THAT(finding->advice, HasSubstr("atelier masks"));
}

TEST_F(SmallRig, CorrectionOfACameraThatIsNotThere_NamesTheFlagAsTyped) {
  write();
  DatasetOptions options;
  options.corrections.leave_out = "09";
  ATELIER_EXPECT_REFUSED(open_dataset(capture(), options), UsageError,
                         "capture.leave_out cannot be '09': it takes some, but not all, of 00");
  for (const char* all : {"all", "00,01,02", "02,00,01"}) {
    options.corrections.leave_out = all;
    ATELIER_EXPECT_REFUSED(open_dataset(capture(), options), UsageError,
                           "capture.leave_out cannot be '" + std::string(all) +
                               "': it takes some, but not all, of 00, 01, 02");
  }
  options.corrections = {};
  options.corrections.calibration_of = "00=09";
  ATELIER_EXPECT_REFUSED(open_dataset(capture(), options), UsageError,
                         "capture.calibration_of cannot be '09': it takes one of 00, 01, 02");
  options.corrections = {};
  options.corrections.pixel_shift = "00=left";
  ATELIER_EXPECT_REFUSED(open_dataset(capture(), options), UsageError,
                         "capture.pixel_shift cannot be 'left': it takes pixels");
}

TEST(SettleAdvice, WhatIsSet_IsNotAdvisedAgain) {
  Dataset dataset;
  const auto advised = [&](const std::string& set, const std::string& setting) {
    const std::size_t space = setting.find(' ');
    std::string option = setting.substr(10, space - 10);
    std::replace(option.begin(), option.end(), '-', '_');
    dataset.corrections = {{option, set}};
    return settle_advice({{Severity::Error, "x", "", "what", "advice", setting}}, dataset).front();
  };
  const Finding inverse = advised("all=inverse", "--capture.extrinsics all=inverse");
  EXPECT_EQ(inverse.setting, "");
  EXPECT_THAT(inverse.advice, HasSubstr("take --capture.extrinsics all=inverse away"));
  const Finding masks = advised("01=inverted", "--capture.masks 01=inverted");
  EXPECT_EQ(masks.setting, "");
  EXPECT_THAT(masks.advice, HasSubstr("take --capture.masks 01=inverted away"));
  EXPECT_EQ(advised("01=inverted,02=inverted", "--capture.masks 01=inverted").setting,
            "--capture.masks 02=inverted");
  EXPECT_EQ(advised("cam1=2", "--capture.sync cam3=1").setting, "--capture.sync cam1=2,cam3=1");
  EXPECT_EQ(advised("cam3=2", "--capture.sync cam3=1").setting, "--capture.sync cam3=3");
  EXPECT_EQ(advised("cam3=2", "--capture.sync cam3=-2").setting, "");
  EXPECT_EQ(advised("cam3=1000", "--capture.baseline cam3=0.001").setting, "");
  EXPECT_EQ(advised("cam3=inverse", "--capture.extrinsics cam3=opengl").setting,
            "--capture.extrinsics cam3=inverse_opengl");
  EXPECT_EQ(advised("cam3=position", "--capture.extrinsics cam3=inverse").setting,
            "--capture.extrinsics cam3=transposed");
  const Finding both = advised("cam3=opengl", "--capture.extrinsics cam3=inverse");
  EXPECT_EQ(both.setting, "");  // no one value reads both
  EXPECT_THAT(both.advice, HasSubstr("take --capture.extrinsics cam3=opengl away"));
  EXPECT_EQ(advised("02", "--capture.leave-out 04,05").setting, "--capture.leave-out 02,04,05");
  EXPECT_EQ(advised("cam3=90", "--capture.turned cam3=180").setting, "--capture.turned cam3=270")
      << "both turns together";
  EXPECT_EQ(advised("cam3=90", "--capture.turned cam3=270").setting, "");
  EXPECT_EQ(advised("01=02", "--capture.calibration-of 01=03").setting, "") << "names, no numbers";
  dataset.cameras.resize(2);
  dataset.cameras[0].id = "00";
  dataset.cameras[1].id = "01";
  EXPECT_EQ(advised("all=inverted", "--capture.masks 00=inverted").setting,
            "--capture.masks 01=inverted");
  dataset.corrections = {{"turned", "00=90"}};
  EXPECT_EQ(
      settle_advice({{Severity::Error, "image-turned", "00", "w", "a", "--capture.turned 00=270"}},
                    dataset)
          .front()
          .setting,
      "--capture.turned 00=270")
      << "of sizes, which takes the place of the other";
  // Another option's setting stays.
  dataset.corrections = {{"masks", "all=inverted"}};
  EXPECT_EQ(settle_advice({{Severity::Error, "x", "", "w", "a", "--capture.sync c=1"}}, dataset)
                .front()
                .setting,
            "--capture.sync c=1");
}

SeededRig small_rig() {
  SeededRig rig;
  rig.circle = {.count = 6, .width = 80, .height = 100, .focal = 125};
  rig.frames = 4;
  return rig;
}

TEST(ValidateCorrections, WrongInversion_IsAnsweredByTakingItAway) {
  TemporaryDirectory folder;
  SeededRig rig = small_rig();
  rig.pictures = false;
  write_seeded(seeded_capture(rig), folder / "capture");
  DatasetOptions options;
  options.corrections.extrinsics = "all=inverse";
  const auto findings = validated(folder / "capture", options);
  bool named = false;
  for (const Finding& finding : findings) {
    EXPECT_THAT(finding.setting, ::testing::Not(HasSubstr("extrinsics all=inverse")))
        << to_string(finding);
    named = named ||
            finding.advice.find("take --capture.extrinsics all=inverse away") != std::string::npos;
  }
  EXPECT_TRUE(named);
}

TEST(CheckCameras, WrongConventionOfAll_IsTriedBeforeItIsAdvised) {
  std::vector<Camera> cameras = circle_of_cameras();
  EXPECT_EQ(finding_named(check_cameras(cameras), "cameras-apart"), nullptr);
  for (Camera& camera : cameras) {  // as a file that has cameras to world is read
    const Eigen::Vector3d centre = camera_center(camera);
    camera.camera_from_world_rotation.transposeInPlace();
    camera.camera_from_world_translation = centre;
  }
  const auto findings = check_cameras(cameras);
  const Finding* finding = finding_named(findings, "cameras-apart");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->setting, "--capture.extrinsics all=inverse");
}

/// A camera that a file may hold.
std::vector<Camera> hostile_cameras(const Camera& good) {
  std::vector<Camera> cameras;
  for (int axis = 0; axis < 3; ++axis) {
    for (int degrees = -180; degrees <= 180; degrees += 15) {
      for (const double off : {0.0, 1e-9, 1e-3}) {
        Camera camera = good;
        const Eigen::Vector3d turn =
            (degrees * 3.14159265358979 / 180 + off) * Eigen::Vector3d::Unit(axis);
        camera.camera_from_world_rotation =
            rotation_of_vector(turn) * good.camera_from_world_rotation;
        cameras.push_back(camera);
      }
    }
  }
  for (const double huge : {1e6, 1e9, 1e12, 1e18, 1e100, 1e300}) {
    for (const double sign : {-1.0, 1.0}) {
      for (int kind = 0; kind < 6; ++kind) {
        Camera camera = good;
        camera.fx = kind == 0 || kind == 1 ? huge : camera.fx;
        camera.fy = kind == 1 ? huge : camera.fy;
        camera.cx = kind == 2 ? sign * huge : camera.cx;
        camera.cy = kind == 3 ? sign * huge : camera.cy;
        if (kind >= 4) {
          camera.distortion_model = kind == 4 ? Distortion::Brown : Distortion::Fisheye;
          for (std::size_t i = 0; i < 4; ++i) {
            camera.distortion[i] = sign * huge;
          }
        }
        cameras.push_back(camera);
      }
      Camera camera = good;
      camera.camera_from_world_translation *= sign * huge;
      cameras.push_back(camera);
    }
  }
  return cameras;
}

TEST(HostileCameras, EveryTurnAndHugeNumbers_BreakNoCheckOfLabels) {
  TemporaryDirectory folder;
  write_seeded(seeded_capture(small_rig()), folder / "capture");
  const Dataset good = open_dataset(folder / "capture");
  FrameReader reader(good);
  KeypointCheck keypoints = check_keypoints(reader, {});
  ASSERT_TRUE(keypoints.calibration_fits);
  const std::vector<Camera> hostile = hostile_cameras(good.cameras[0]);
  for (std::size_t at = 0; at < hostile.size();) {
    Dataset spoilt = good;
    for (Camera& camera : spoilt.cameras) {
      const std::string id = camera.id;
      camera = hostile[std::min(at++, hostile.size() - 1)];
      camera.id = id;
    }
    FrameReader spoilt_reader(std::move(spoilt));
    EXPECT_NO_THROW(check_labels(spoilt_reader, keypoints));
  }
}

TEST(HostileCameras, EveryTurnAndHugeNumbers_BreakNoCheckOfCamerasAndKeypoints) {
  TemporaryDirectory folder;
  SeededRig rig = small_rig();
  rig.pictures = false;
  write_seeded(seeded_capture(rig), folder / "capture");
  const Dataset good = open_dataset(folder / "capture");
  std::size_t turn = 0;
  for (const Camera& camera : hostile_cameras(good.cameras[1])) {
    Dataset spoilt = good;
    spoilt.cameras[1] = camera;
    EXPECT_NO_THROW(check_cameras(spoilt.cameras));
    constexpr std::size_t kEvery = 24;  // triangulation takes its time
    if (turn++ % kEvery == 0) {
      FrameReader reader(std::move(spoilt));
      EXPECT_NO_THROW(validate(reader));
    }
  }
}

}  // namespace
}  // namespace atelier::fixtures
