// Conventions of extrinsics that files are in, told without keypoints: for every layout and every
// convention what is advised is right, or it is said that it cannot be told. Rigs of two and
// of three cameras with keypoints, and cameras whose counters begin again.

#include "capture/rig_convention.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/camera_conventions.h"
#include "capture/camera_readings.h"
#include "capture/check_cameras.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "capture/sentence.h"
#include "capture/silhouettes.h"
#include "capture/validate.h"
#include "core/io/file_bytes.h"
#include "core/random.h"
#include "tests/capture/circle_of_cameras.h"
#include "tests/capture/followed_advice.h"
#include "tests/capture/misread_rig.h"
#include "tests/capture/seeded_capture.h"
#include "tests/capture/small_capture.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

Camera camera_looking(const Eigen::Vector3d& from, const Eigen::Vector3d& at, double roll,
                      int index) {
  Camera camera;
  camera.id = (index < 10 ? "0" : "") + std::to_string(index);
  camera.width = 64;
  camera.height = 80;
  camera.fx = camera.fy = 90;
  camera.cx = 32;
  camera.cy = 40;
  const Eigen::Vector3d z = (at - from).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d(0, -1, 0).cross(z).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  camera.camera_from_world_rotation =
      Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()).toRotationMatrix() * rotation;
  camera.camera_from_world_translation = -camera.camera_from_world_rotation * from;
  return camera;
}

struct NamedRig {
  const char* name;
  std::vector<Camera> cameras;
};

/// A ring, half a dome, an arc in front and two cameras, aimed and held as people do.
std::vector<NamedRig> named_rigs() {
  Random random{7};
  const auto deviate = [&](double by) { return by * (2 * uniform(random) - 1); };
  const auto build = [&](const std::vector<Eigen::Vector3d>& places) {
    std::vector<Camera> cameras;
    for (const Eigen::Vector3d& place : places) {
      const Eigen::Vector3d at(deviate(0.15), 1 + deviate(0.15), deviate(0.15));
      cameras.push_back(camera_looking(place, at, deviate(0.03), static_cast<int>(cameras.size())));
    }
    return cameras;
  };
  const auto on = [](double azimuth, double elevation, double radius) {
    return Eigen::Vector3d(radius * std::cos(elevation) * std::sin(azimuth),
                           1 + radius * std::sin(elevation),
                           radius * std::cos(elevation) * std::cos(azimuth));
  };
  std::vector<Eigen::Vector3d> ring;
  std::vector<Eigen::Vector3d> dome;
  std::vector<Eigen::Vector3d> arc;
  for (int i = 0; i < 8; ++i) {
    ring.push_back(on(i * 0.7854, i % 2 == 0 ? -0.1 : 0.35, 3));
    arc.push_back(on(-0.9 + 0.26 * i, i % 2 == 0 ? 0.05 : 0.3, 2.5));
  }
  for (int i = 0; i < 10; ++i) {
    dome.push_back(on(i * 0.6283, i % 3 * 0.45, 2.8));
  }
  const std::vector<Eigen::Vector3d> pair = {on(-0.5, 0.1, 2.5), on(0.4, 0.3, 2.5)};
  return {{"ring", build(ring)}, {"dome", build(dome)}, {"arc", build(arc)}, {"pair", build(pair)}};
}

bool says_untold(const std::vector<Finding>& findings) {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.severity != Severity::Note && finding.setting.empty() &&
           (finding.code == "extrinsics-untold" || finding.code == "cameras-apart" ||
            finding.code == "extrinsics-doubtful");
  });
}

/// Options with all that is advised: of extrinsics, up and unit.
DatasetOptions options_followed(DatasetOptions options, const std::vector<Finding>& findings) {
  for (const std::string& setting : settings_of(findings)) {
    const std::string value = setting.substr(setting.find(' ') + 1);
    if (setting.starts_with("--capture.extrinsics ")) {
      options.corrections.extrinsics = value;
    } else if (setting.starts_with("--capture.up ")) {
      options.up = value;
    } else if (setting.starts_with("--capture.metres-per-unit ")) {
      options.metres_per_unit = std::strtod(value.c_str(), nullptr);
    }
  }
  return options;
}

/// What becomes of a capture without keypoints whose rig is the given one: right as it is and left
/// so, right once what is advised is done, or said to be open.
void expect_right_or_said(const fs::path& folder, const std::vector<Camera>& truth,
                          const std::string& what, int& told) {
  DatasetOptions options;
  FrameReader reader(open_dataset(folder, options));
  const std::vector<Finding> findings = validate(reader).findings;
  if (says_untold(findings)) {
    return;
  }
  const Dataset then = open_dataset(folder, options_followed(options, findings));
  EXPECT_TRUE(same_rig(then.cameras, truth)) << what << "\n" << all_lines(findings);
  ++told;
}

class ConventionOfLayout : public ::testing::TestWithParam<const char*> {};

TEST_P(ConventionOfLayout, EveryConvention_IsAdvisedRightlyOrSaidToBeOpen) {
  int told = 0;
  int all = 0;
  for (const NamedRig& rig : named_rigs()) {
    for (const std::string value : kExtrinsicValues) {
      const TemporaryDirectory folder;
      SmallCapture small;
      small.cameras = rig.cameras;
      small.detections = false;
      small.frames = {3};
      // Which world the layout's files have is known once it was written and read.
      write_small_capture(folder / "sound", small);
      const fs::path sound =
          write_layout(folder / "sound", GetParam(), folder / "written").folders.front();
      const Dataset read = open_dataset(sound);
      for (std::size_t c = 0; c < small.cameras.size(); ++c) {
        small.cameras[c] = misread(rig.cameras[c], read.world_convention, value);
      }
      write_small_capture(folder / "wrong", small);
      const fs::path wrong =
          write_layout(folder / "wrong", GetParam(), folder / "misread").folders.front();
      fs::remove_all(wrong / "keypoints2d");
      for (const char* masks : {"masks", "labels", "mask", "fmask_lists", "segmentation_parts"}) {
        fs::remove_all(wrong / masks);
      }
      ++all;
      expect_right_or_said(wrong, read.cameras,
                           std::string(GetParam()) + " " + rig.name + " '" + value + "'", told);
    }
  }
  // With Z up rotations say which of their sides is which; elsewhere some stay open.
  EXPECT_GE(told, all / 2) << GetParam();
}

INSTANTIATE_TEST_SUITE_P(Layouts, ConventionOfLayout,
                         ::testing::Values("native", "easymocap", "goliath", "actorshq",
                                           "mvhumannet", "avatarrex", "thuman4", "panoptic",
                                           "human36m", "colmap", "nerfstudio", "caliscope",
                                           "pose2sim", "qualisys", "anipose"));

/// What rigs that were misread in every way are taken for.
struct ToldRigs {
  int told = 0;     ///< one value is likely
  int wrong = 0;    ///< values are likely, and the right one is not among them
  int without = 0;  ///< no value is likely
  int all = 0;
};

void add_told(const std::vector<Camera>& cameras, ToldRigs& rigs) {
  for (const WorldConvention& world :
       {WorldConvention{1, "z"}, WorldConvention{1, "y"}, WorldConvention{1, "-y"}}) {
    for (const std::string value : kExtrinsicValues) {
      std::vector<Camera> read;
      for (const Camera& camera : cameras) {
        read.push_back(misread(camera, world, value));
      }
      const std::vector<std::string> likely = likely_values(rig_readings(read, world));
      const bool kept = std::find(likely.begin(), likely.end(), value) != likely.end();
      ++rigs.all;
      rigs.told += likely.size() == 1 ? 1 : 0;
      rigs.without += likely.empty() ? 1 : 0;
      rigs.wrong += kept || likely.empty() ? 0 : 1;
    }
  }
}

TEST(RigConvention, RandomRigs_AreNeverToldWrongly) {
  Random random{11};
  ToldRigs rigs;
  for (int round = 0; round < 60; ++round) {
    std::vector<Camera> cameras;
    const int count = 4 + round % 9;
    const double spread = round % 3 == 0 ? 6.2832 : 2;
    for (int i = 0; i < count; ++i) {
      const double azimuth = spread * i / count + 0.1 * uniform(random);
      const Eigen::Vector3d from(3 * std::sin(azimuth), 0.6 + 1.4 * uniform(random),
                                 3 * std::cos(azimuth));
      const Eigen::Vector3d at(0.4 * uniform(random) - 0.2, 1, 0.4 * uniform(random) - 0.2);
      cameras.push_back(camera_looking(from, at, 0.1 * uniform(random) - 0.05, i));
    }
    add_told(cameras, rigs);
  }
  EXPECT_LE(rigs.wrong + rigs.without, rigs.all / 200) << "of " << rigs.all;
  EXPECT_GT(rigs.told, rigs.all / 2) << "of " << rigs.all;
}

// Cameras round an animal hang as there was room, and the world is that of the first: no reading
// has a common up, and none may be said to fit far better for it.
TEST(RigConvention, CamerasOfAnyRoll_AreNotDoubtedByWhatIsAboveThem) {
  Random random{29};
  int doubted = 0;
  for (int round = 0; round < 200; ++round) {
    std::vector<Camera> cameras;
    const int count = 3 + round % 4;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d from =
          Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized() *
          (2 + uniform(random));
      cameras.push_back(camera_looking(
          from,
          0.2 *
              Eigen::Vector3d(uniform(random) - 0.5, uniform(random) - 0.5, uniform(random) - 0.5),
          6.2832 * uniform(random), i));
    }
    const Camera first = cameras.front();
    for (Camera& camera : cameras) {
      camera.camera_from_world_translation -= camera.camera_from_world_rotation *
                                              first.camera_from_world_rotation.transpose() *
                                              first.camera_from_world_translation;
      camera.camera_from_world_rotation =
          camera.camera_from_world_rotation * first.camera_from_world_rotation.transpose();
    }
    WorldConvention world{1, "y"};
    world.up_guessed = true;
    const std::vector<RigReading> readings = rig_readings(cameras, world);
    const std::vector<std::string> likely = likely_values(readings);
    const bool kept = std::find(likely.begin(), likely.end(), "") != likely.end();
    doubted += kept || likely.empty() ? 0 : 1;
  }
  EXPECT_LE(doubted, 4) << "of 200";
}

/// transform_matrix of a transforms.json, by what the file's matrix is.
void rewrite_transforms(const fs::path& folder,
                        const std::function<Eigen::Matrix4d(const Eigen::Matrix4d&)>& change) {
  nlohmann::json root = nlohmann::json::parse(read_file_text(folder / "transforms.json", 1 << 24));
  for (auto& frame : root["frames"]) {
    Eigen::Matrix4d matrix;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        matrix(i, j) = frame["transform_matrix"][i][j].get<double>();
      }
    }
    matrix = change(matrix);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        frame["transform_matrix"][i][j] = matrix(i, j);
      }
    }
  }
  write_file_atomically(folder / "transforms.json", root.dump());
}

TEST(RigConvention, TransformsJsonOfOtherConventions_AreAdvisedRightly) {
  const Eigen::Matrix4d flip = Eigen::Vector4d(1, -1, -1, 1).asDiagonal();
  const std::vector<std::function<Eigen::Matrix4d(const Eigen::Matrix4d&)>> changes = {
      [&](const Eigen::Matrix4d& m) { return Eigen::Matrix4d(m * flip); },     // OpenCV
      [&](const Eigen::Matrix4d& m) { return Eigen::Matrix4d(m.inverse()); },  // to camera
      [&](const Eigen::Matrix4d& m) { return Eigen::Matrix4d((m * flip).inverse()); }};
  for (const NamedRig& rig : named_rigs()) {
    for (std::size_t i = 0; i < changes.size(); ++i) {
      const TemporaryDirectory folder;
      SmallCapture small;
      small.cameras = rig.cameras;
      small.frames = {3};
      write_small_capture(folder / "sound", small);
      const fs::path written =
          write_layout(folder / "sound", "nerfstudio", folder / "out").folders.front();
      fs::remove_all(written / "masks");
      rewrite_transforms(written, [](const Eigen::Matrix4d& m) { return m; });
      const std::vector<Camera> truth = open_dataset(written).cameras;
      rewrite_transforms(written, changes[i]);
      std::string text = read_file_text(written / "transforms.json", 1 << 24);
      for (std::size_t at; (at = text.find("\"mask_path\"")) != std::string::npos;) {
        text.erase(at, text.find(',', at) - at + 1);
      }
      write_file_atomically(written / "transforms.json", text);
      int told = 0;
      expect_right_or_said(written, truth, std::string(rig.name) + " " + std::to_string(i), told);
      if (i == 0) {  // the others turn the world over, which makes them open in some rigs
        EXPECT_EQ(told, 1) << rig.name;
      }
    }
  }
}

TEST(RigConvention, LevelRingRoundY_IsSaidToBeOpenUnlessMasksTell) {
  CircleOfCameras circle{.count = 8, .width = 64, .height = 80, .focal = 90, .low = 1, .high = 1};
  std::vector<Camera> cameras = circle_of_cameras(circle);
  const std::vector<std::string> likely = likely_values(rig_readings(cameras, {1, "y"}));
  EXPECT_EQ(likely.size(), 2U);
  EXPECT_THAT(likely, ::testing::UnorderedElementsAre("", "transposed"));
  const auto findings = check_cameras(cameras);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, "extrinsics-untold");
  EXPECT_EQ(findings[0].setting, "");
  // A box of unlike sides, off the axis, is another thing to cameras in the other order.
  const auto masks_of = [&](const std::vector<Camera>& seen_by) {
    std::vector<ByteImage> masks;
    for (const Camera& camera : seen_by) {
      ByteImage mask(camera.width, camera.height, 1);
      for (double x = 0.1; x < 0.75; x += 0.01) {
        for (double y = 0.5; y < 1.5; y += 0.01) {
          for (double z = -0.05; z < 0.1; z += 0.01) {
            const auto pixel = project(camera, {x, y, z});
            if (pixel && pixel->x() >= 0 && pixel->x() < 64 && pixel->y() >= 0 && pixel->y() < 80) {
              mask.at(static_cast<int>(pixel->x()), static_cast<int>(pixel->y())) = 255;
            }
          }
        }
      }
      masks.push_back(mask);
    }
    return masks;
  };
  const std::vector<ByteImage> masks = masks_of(cameras);
  EXPECT_GT(silhouette_agreement(cameras, masks, {0, 1, 0}), 0.95);
  std::vector<Camera> other;
  for (const Camera& camera : cameras) {
    other.push_back(read_as(camera, "extrinsics", "transposed"));
  }
  std::vector<Camera> inverse;
  for (const Camera& camera : cameras) {
    inverse.push_back(read_as(camera, "extrinsics", "inverse"));
  }
  EXPECT_LT(silhouette_agreement(inverse, masks, {0, 1, 0}), 0.5);
  for (const bool wrong : {false, true}) {
    const TemporaryDirectory folder;
    SmallCapture small;
    small.cameras = wrong ? other : cameras;
    small.detections = false;
    write_small_capture(folder.path() / "capture", small);
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      for (const int frame : small.frames) {
        ByteImage labels = masks[c];
        for (auto& value : labels.data) {
          value = value != 0 ? 3 : 0;
        }
        write_labels(
            folder.path() / "capture" / "labels" / cameras[c].id / (frame_name(frame) + ".png"),
            labels);
      }
    }
    FrameReader reader(open_dataset(folder.path() / "capture"));
    const auto found = validate(reader).findings;
    const std::vector<std::string> settings = settings_of(found);
    // Cameras in the other order see nearly the same of a thing that is not chiral.
    const auto advised = std::count_if(
        settings.begin(), settings.end(),
        [](const std::string& one) { return one.starts_with("--capture.extrinsics "); });
    EXPECT_EQ(std::count(settings.begin(), settings.end(), "--capture.extrinsics all=transposed"),
              advised)
        << all_lines(found);
    EXPECT_LE(advised, wrong ? 1 : 0) << all_lines(found);
    EXPECT_TRUE(advised == 1 || says_untold(found) || !wrong) << all_lines(found);
  }
}

TEST(Silhouettes, MasksOfNothingInCommon_DoNotAgree) {
  const std::vector<Camera> cameras =
      circle_of_cameras({.count = 4, .width = 64, .height = 80, .focal = 90});
  std::vector<ByteImage> masks(cameras.size(), ByteImage(64, 80, 1));
  EXPECT_EQ(silhouette_agreement(cameras, masks, {0, 1, 0}), 0);
  for (std::size_t c = 0; c < masks.size(); ++c) {
    for (int y = 0; y < 10; ++y) {
      masks[c].at(c % 2 == 0 ? 2 : 60, c % 2 == 0 ? y : 79 - y) = 255;
    }
  }
  EXPECT_LT(silhouette_agreement(cameras, masks, {0, 1, 0}), 0.3);
}

/// The first cameras of a ring, with detections alone.
SeededCapture first_of_ring(int cameras, int ring, int frames) {
  SeededRig rig;
  rig.circle.count = ring;
  rig.frames = frames;
  rig.pictures = false;
  SeededCapture capture = seeded_capture(rig);
  capture.cameras.resize(static_cast<std::size_t>(cameras));
  capture.keypoints.resize(static_cast<std::size_t>(cameras));
  return capture;
}

class RigOfCameras : public ::testing::TestWithParam<std::pair<int, int>> {};

TEST_P(RigOfCameras, ConventionOfAll_IsAdvisedRightlyOrSaidToBeOpen) {
  const auto [count, ring] = GetParam();
  const SeededCapture sound = first_of_ring(count, ring, 12);
  int told = 0;
  for (const std::string value : kExtrinsicValues) {
    const TemporaryDirectory folder;
    SeededCapture capture = sound;
    for (Camera& camera : capture.cameras) {
      camera = misread(camera, {1, "y"}, value);
    }
    write_seeded(capture, folder.path());
    const Followed result = follow(folder.path());
    const std::string what =
        std::to_string(count) + " cameras '" + value + "'\n" + all_lines(result.findings);
    const bool right = same_rig(result.dataset.cameras, sound.cameras);
    EXPECT_TRUE(right || has_errors(result.findings)) << what;
    EXPECT_TRUE(right || !result.corrections.contains("extrinsics")) << what;
    told += right ? 1 : 0;
  }
  EXPECT_GE(told, count == 2 ? 1 : 6);
}

INSTANTIATE_TEST_SUITE_P(Counts, RigOfCameras, ::testing::Values(std::pair(2, 6), std::pair(3, 8)),
                         [](const auto& rig) { return std::to_string(rig.param.first); });

TEST(RigConvention, RandomPairs_AreNeverToldWrongly) {
  Random random{13};
  ToldRigs rigs;
  for (int round = 0; round < 60; ++round) {
    std::vector<Camera> cameras = circle_of_cameras(
        {.count = 3 + round % 6, .width = 64, .height = 80, .focal = 90, .radius = 2.5});
    cameras.resize(2);
    for (Camera& camera : cameras) {
      const Eigen::Vector3d centre = camera_center(camera);
      const Eigen::Vector3d turn(0.1 * uniform(random) - 0.05, 0.1 * uniform(random) - 0.05,
                                 0.06 * uniform(random) - 0.03);
      camera.camera_from_world_rotation =
          Eigen::AngleAxisd(turn.norm(), turn.normalized()) * camera.camera_from_world_rotation;
      camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
    }
    add_told(cameras, rigs);
  }
  EXPECT_LE(rigs.wrong, rigs.all / 200) << "of " << rigs.all;
  EXPECT_GT(rigs.told, rigs.all / 4) << "of " << rigs.all;
}

// One before and one behind the person, as a walkway has them.
TEST(RigConvention, CamerasFaceToFace_LookAtTheMiddleAndAreNeverToldWrongly) {
  Random random{31};
  ToldRigs rigs;
  for (int round = 0; round < 60; ++round) {
    const double azimuth = 6.2832 * uniform(random);
    const double across = 0.3 * uniform(random) - 0.15;  // rad off the opposite
    std::vector<Camera> cameras;
    for (int i = 0; i < 2; ++i) {
      const double angle = azimuth + i * (3.14159265358979 + across);
      const Eigen::Vector3d from(3 * std::sin(angle), 0.8 + 0.8 * uniform(random),
                                 3 * std::cos(angle));
      const Eigen::Vector3d at(0.1 * uniform(random), 1, 0.1 * uniform(random));
      cameras.push_back(camera_looking(from, at, 0.06 * uniform(random) - 0.03, i));
    }
    const Gaze gaze = gaze_of(cameras);
    EXPECT_EQ(gaze.agreeing, 2);
    EXPECT_FALSE(gaze.side_by_side);
    EXPECT_LT((gaze.place - Eigen::Vector3d(0, 1, 0)).norm(), 1.0);
    add_told(cameras, rigs);
  }
  EXPECT_LE(rigs.wrong, rigs.all / 200) << "of " << rigs.all;
  // Back to back they look at nothing in common.
  std::vector<Camera> away = {camera_looking({0, 1, 3}, {0, 1, 9}, 0, 0),
                              camera_looking({0, 1, -3}, {0, 1, -9}, 0, 1)};
  EXPECT_EQ(gaze_of(away).agreeing, 0);
}

TEST(WrappedCounter, OfOneCamera_IsOfTheOthersFrames) {
  const TemporaryDirectory folder;
  const fs::path capture = folder / "capture";
  SmallCapture small;
  small.frames = {9997, 9998, 9999, 10000, 10001, 10002};
  small.detections = false;
  write_small_capture(capture, small);
  for (const int frame : small.frames) {
    const auto rename = [&](const char* camera, const std::string& name) {
      const fs::path images = capture / "images" / camera;
      fs::rename(images / (frame_name(frame) + ".png"), images / name);
    };
    rename("00", sentence("DSC%05d.png", frame % 10000));  // 09999, then 00000
    rename("01", sentence("IMG_%04d.png", frame - 9000));  // a counter of its own
  }
  const Dataset dataset = open_dataset(capture);
  for (const std::size_t camera : {0U, 2U}) {
    std::vector<int> frames;
    for (const auto& [frame, place] : dataset.frames[camera].images) {
      frames.push_back(frame);
    }
    EXPECT_EQ(frames, small.frames) << camera;
  }
  EXPECT_EQ(dataset.frames[0].images.find(10001)->file.filename(), "DSC00001.png");
}

}  // namespace
}  // namespace atelier::fixtures
