// What validate finds: cameras, images, masks and detections that were good, and then were not.

#include "capture/validate.h"

#include <Eigen/Geometry>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/check_cameras.h"
#include "capture/check_keypoints.h"
#include "capture/detector.h"
#include "capture/label_taxonomy.h"
#include "capture/refit_pose.h"
#include "capture/seen_person.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/random.h"
#include "tests/capture/circle_of_cameras.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> codes(const std::vector<Finding>& findings) {
  std::vector<std::string> all;
  for (const Finding& finding : findings) {
    EXPECT_FALSE(finding.what.empty());
    EXPECT_FALSE(finding.advice.empty()) << finding.code;
    all.push_back(finding.code);
  }
  return all;
}

bool has(const std::vector<Finding>& findings, const std::string& code,
         const std::string& place = "") {
  return std::any_of(findings.begin(), findings.end(), [&](const Finding& finding) {
    return finding.code == code && finding.place.starts_with(place);
  });
}

std::vector<Camera> stage(int count = 8) {
  return circle_of_cameras({.count = count, .width = 200, .height = 250, .focal = 300});
}

TEST(CheckCameras, GoodRig_HasNoFinding) {
  EXPECT_THAT(codes(check_cameras(stage())), IsEmpty());
}

TEST(CheckCameras, FisheyeBeyond90Degrees_IsANoteUnlessItFolds) {
  std::vector<Camera> cameras = stage();
  cameras[0].distortion_model = Distortion::Fisheye;
  cameras[0].fx = cameras[0].fy = 50;  // 2 radians to either side
  std::vector<Finding> findings = check_cameras(cameras);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, "camera-distortion");
  EXPECT_EQ(findings[0].severity, Severity::Note);
  cameras[0].distortion = {-0.3};
  findings = check_cameras(cameras);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].severity, Severity::Error);
}

TEST(CheckCameras, DistortionOfNoLens_IsDoubtedThoughItFoldsNowhere) {
  std::vector<Camera> cameras = stage();
  cameras[3].distortion_model = Distortion::Brown;
  cameras[3].distortion = {-0.1, 0, 0, 0, 900};
  std::vector<Finding> findings = check_cameras(cameras);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, "camera-distortion");
  EXPECT_EQ(findings[0].place, cameras[3].id);
  EXPECT_THAT(findings[0].what, ::testing::HasSubstr("times as far from the centre"));
  cameras[3].distortion = {0.3, 0.1};  // a strong pincushion
  EXPECT_TRUE(check_cameras(cameras).empty());
}

struct CameraDefect {
  const char* code;
  const char* place;
  void (*spoil)(std::vector<Camera>& cameras);
};

class CheckCamerasDefect : public ::testing::TestWithParam<CameraDefect> {};

TEST_P(CheckCamerasDefect, CameraDefect_IsNamed) {
  std::vector<Camera> cameras = stage();
  GetParam().spoil(cameras);
  const std::vector<Finding> findings = check_cameras(cameras);
  EXPECT_TRUE(has(findings, GetParam().code, GetParam().place))
      << ::testing::PrintToString(codes(findings));
}

void invert_pose(Camera& camera) {
  const Eigen::Vector3d centre = camera_center(camera);
  camera.camera_from_world_rotation.transposeInPlace();
  camera.camera_from_world_translation = centre;
}

INSTANTIATE_TEST_SUITE_P(
    Table, CheckCamerasDefect,
    ::testing::Values(
        CameraDefect{"camera-looks-away", "cam3",
                     [](std::vector<Camera>& c) { invert_pose(c[3]); }},
        CameraDefect{"camera-looks-away", "cam5",
                     [](std::vector<Camera>& c) {
                       c[5].camera_from_world_translation = camera_center(c[5]);
                     }},
        CameraDefect{"cameras-apart", "",
                     [](std::vector<Camera>& c) {
                       for (Camera& camera : c) {
                         camera.camera_from_world_rotation.row(2) *= -1;
                         camera.camera_from_world_rotation.row(0) *= -1;
                         camera.camera_from_world_translation.x() *= -1;
                         camera.camera_from_world_translation.z() *= -1;
                       }
                     }},
        CameraDefect{"stage-size", "",
                     [](std::vector<Camera>& c) {
                       for (Camera& camera : c) {
                         camera.camera_from_world_translation *= 1000;
                       }
                     }},
        CameraDefect{"stage-size", "",
                     [](std::vector<Camera>& c) {
                       for (Camera& camera : c) {
                         camera.camera_from_world_translation *= 0.001;
                       }
                     }},
        CameraDefect{"stage-up", "",
                     [](std::vector<Camera>& c) {
                       Eigen::Matrix3d turn;
                       turn << 1, 0, 0, 0, 0, 1, 0, -1, 0;
                       for (Camera& camera : c) {
                         camera.camera_from_world_rotation *= turn;
                       }
                     }},
        CameraDefect{"camera-twins", "cam6",
                     [](std::vector<Camera>& c) {
                       c[6].camera_from_world_rotation = c[2].camera_from_world_rotation;
                       c[6].camera_from_world_translation = c[2].camera_from_world_translation;
                     }},
        CameraDefect{"camera-focal", "cam1", [](std::vector<Camera>& c) { c[1].fx = c[1].fy = 3; }},
        CameraDefect{"camera-aspect", "cam1", [](std::vector<Camera>& c) { c[1].fx *= 1.5; }},
        CameraDefect{"camera-principal-point", "cam4",
                     [](std::vector<Camera>& c) { c[4].cx = 10; }},
        CameraDefect{"camera-distortion", "cam0", [](std::vector<Camera>& c) {
                       c[0].distortion_model = Distortion::Brown;
                       c[0].distortion = {-3};
                     }}));

TEST(CheckCameras, CamerasOnABar_AreNotCalledApart) {
  std::vector<Camera> bar = stage(4);
  for (std::size_t c = 0; c < bar.size(); ++c) {
    const Eigen::Vector3d centre(0.3 * static_cast<double>(c), 1.2, 3);
    bar[c].camera_from_world_rotation = bar[0].camera_from_world_rotation;
    bar[c].camera_from_world_translation = -bar[c].camera_from_world_rotation * centre;
  }
  EXPECT_THAT(codes(check_cameras(bar)), IsEmpty());
}

TEST(RefitPose, OutlierPixels_DoNotPreventRefit) {
  const Camera truth = stage(8)[2];
  Random random{4, 0, 0};
  std::vector<Sighting> sightings;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d place(uniform(random, -0.5, 0.5), uniform(random, 0.2, 1.8),
                                uniform(random, -0.5, 0.5));
    const bool wild = i % 6 == 0;
    const double noise = wild ? 200 : 0;
    sightings.push_back(
        {place, *project(truth, place) + noise * Eigen::Vector2d(normal(random), normal(random))});
  }
  Camera off = truth;
  off.camera_from_world_rotation = Eigen::AngleAxisd(0.08, Eigen::Vector3d(1, 2, -1).normalized()) *
                                   off.camera_from_world_rotation;
  off.camera_from_world_translation += Eigen::Vector3d(0.1, -0.2, 0.1);
  const Camera found = refit_pose(off, sightings);
  EXPECT_LT((camera_center(found) - camera_center(truth)).norm(), 0.01);
  EXPECT_LT((found.camera_from_world_rotation - truth.camera_from_world_rotation).norm(), 0.005);
}

TEST(RefitPose, TooFewSightings_LeaveThePoseUnchanged) {
  const Camera camera = stage(8)[0];
  const Eigen::Vector3d behind = 2 * camera_center(camera);
  for (const std::vector<Sighting>& little :
       {std::vector<Sighting>{}, std::vector<Sighting>(5, {{0, 1, 0}, {3, 4}}),
        std::vector<Sighting>(9, {behind, {3, 4}})}) {
    const Camera found = refit_pose(camera, little);
    EXPECT_EQ(found.camera_from_world_rotation, camera.camera_from_world_rotation);
    EXPECT_EQ(found.camera_from_world_translation, camera.camera_from_world_translation);
  }
}

TEST(SurelyLess, SmallerErrors_CountOnlyIfSignificant) {
  Random random{6, 0, 0};
  std::vector<double> now;
  std::vector<double> as_good;
  std::vector<double> better;
  for (int i = 0; i < 200; ++i) {
    now.push_back(std::abs(normal(random)));
    as_good.push_back(std::abs(normal(random)));
    better.push_back(0.6 * std::abs(normal(random)));
  }
  EXPECT_FALSE(surely_less(as_good, now));
  EXPECT_TRUE(surely_less(better, now));
  better.resize(19);
  now.resize(19);
  EXPECT_FALSE(surely_less(better, now));  // of too few
  EXPECT_THROW(surely_less(better, as_good), LogicError);
}

/// Images of noise and masks of a box, on disk, and a data set that lists them.
class CheckFrames : public ::testing::Test {
 protected:
  CheckFrames() {
    dataset_.cameras = stage(3);
    dataset_.root = folder_.path();
    dataset_.frames.resize(3);
    for (int c = 0; c < 3; ++c) {
      dataset_.frames[static_cast<std::size_t>(c)].image_width = 40;
      dataset_.frames[static_cast<std::size_t>(c)].image_height = 50;
      for (int f = 0; f < 6; ++f) {
        put_image(c, f, picture(c, f));
        put_mask(c, f, box());
      }
    }
  }
  static ByteImage picture(int camera, int frame, double gain = 1) {
    ByteImage image(40, 50, 3);
    Random random{static_cast<std::uint64_t>(camera), static_cast<std::uint64_t>(frame), 0};
    for (std::uint8_t& value : image.data) {
      value = static_cast<std::uint8_t>(gain * (60 + 80 * uniform(random)));
    }
    return image;
  }
  static ByteImage box() {
    ByteImage mask(40, 50, 1);
    for (int y = 10; y < 40; ++y) {
      for (int x = 12; x < 28; ++x) {
        mask.at(x, y) = 255;
      }
    }
    return mask;
  }
  std::filesystem::path file(const char* kind, int camera, int frame) const {
    return folder_.path() /
           (std::string(kind) + std::to_string(camera) + "_" + std::to_string(frame) + ".png");
  }
  void put_image(int camera, int frame, const ByteImage& image) {
    write_image(file("i", camera, frame), image);
    dataset_.frames[static_cast<std::size_t>(camera)].images.set(
        frame, {file("i", camera, frame), "", -1});
  }
  void put_mask(int camera, int frame, const ByteImage& mask) {
    write_image(file("m", camera, frame), mask);
    dataset_.frames[static_cast<std::size_t>(camera)].masks.set(frame,
                                                                {file("m", camera, frame), "", -1});
  }
  std::vector<Finding> findings() const {
    FrameReader reader(dataset_);
    return check_frames(reader);
  }

  TemporaryDirectory folder_;
  Dataset dataset_;
};

TEST_F(CheckFrames, GoodImages_HaveNoFinding) {
  EXPECT_THAT(codes(findings()), IsEmpty());
}

TEST_F(CheckFrames, TruncatedImage_IsNamed) {
  std::filesystem::resize_file(file("i", 1, 2), 300);
  EXPECT_TRUE(has(findings(), "image-damaged", "cam1 frame 2"));
}

TEST_F(CheckFrames, BlackSaturatedAndBlurredImages_AreNamed) {
  put_image(0, 3, ByteImage(40, 50, 3));
  put_image(1, 4, ByteImage(40, 50, 3, 255));
  ByteImage smooth(40, 50, 3);
  for (int y = 0; y < 50; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (int c = 0; c < 3; ++c) {
        smooth.at(x, y, c) = static_cast<std::uint8_t>(70 + x + y / 2);
      }
    }
  }
  put_image(2, 5, smooth);
  const std::vector<Finding> found = findings();
  EXPECT_TRUE(has(found, "image-black", "cam0 frame 3"));
  EXPECT_TRUE(has(found, "image-saturated", "cam1 frame 4"));
  EXPECT_TRUE(has(found, "image-blurred", "cam2 frame 5"));
}

TEST_F(CheckFrames, ProgressWithMissingImages_EndsAtItsTotal) {
  dataset_.frames[0].images.erase(2);
  dataset_.frames[1].images.clear();
  for (const int every : {1, 2}) {
    int last = 0;
    int whole = 0;
    FrameReader reader(dataset_);
    FrameCheckOptions options;
    options.every = every;
    check_frames(reader, options, [&](int done, int total) {
      EXPECT_EQ(done, last + 1);
      last = done;
      whole = total;
    });
    EXPECT_EQ(last, whole) << "every " << every;
  }
}

TEST_F(CheckFrames, MissingRepeatedAndBrighterFrames_AreNamed) {
  dataset_.frames[0].images.erase(2);
  put_image(1, 4, picture(1, 3));
  put_image(2, 5, picture(2, 5, 1.6));
  const std::vector<Finding> found = findings();
  EXPECT_TRUE(has(found, "frame-missing", "cam0 frame 2"));
  EXPECT_TRUE(has(found, "frame-duplicate", "cam1 frame 4"));
  put_image(1, 4, picture(1, 1));  // not that of the frame before
  EXPECT_TRUE(has(findings(), "frame-duplicate", "cam1 frame 4"));
  EXPECT_TRUE(has(found, "exposure-jump", "cam2 frame 5"));
}

TEST_F(CheckFrames, CameraWithoutImages_IsNamed) {
  dataset_.frames[1].images.clear();
  EXPECT_TRUE(has(findings(), "camera-without-pictures", "cam1"));
}

TEST_F(CheckFrames, NoImagesAtAll_IsOneFindingOfAllCameras) {
  CaptureSequence sequence{.name = "a", .kind = "clothed", .fps = 30, .frame_ids = {0, 1}};
  dataset_.info.sequences.push_back(sequence);
  for (CameraFrames& frames : dataset_.frames) {
    frames.images.clear();
  }
  EXPECT_EQ(codes(findings()), std::vector<std::string>{"camera-without-pictures"});
}

TEST_F(CheckFrames, ImageOfOtherSize_IsNamed) {
  put_image(0, 1, ByteImage(30, 50, 3, 90));
  EXPECT_TRUE(has(findings(), "frame-size", "cam0 frame 1"));
}

TEST_F(CheckFrames, EmptyFullAndInvertedMasks_AreNamed) {
  put_mask(0, 1, ByteImage(40, 50, 1));
  put_mask(1, 1, ByteImage(40, 50, 1, 255));
  ByteImage inverted = box();
  for (std::uint8_t& value : inverted.data) {
    value = static_cast<std::uint8_t>(255 - value);
  }
  put_mask(2, 1, inverted);
  const std::vector<Finding> found = findings();
  EXPECT_TRUE(has(found, "mask-empty", "cam0 frame 1"));
  EXPECT_TRUE(has(found, "mask-full", "cam1 frame 1"));
  EXPECT_TRUE(has(found, "mask-inverted", "cam2 frame 1"));
}

TEST_F(CheckFrames, MaskFillingTheImage_IsNotCalledInverted) {
  ByteImage close(40, 50, 1, 255);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 6; ++x) {
      close.at(x, y) = close.at(39 - x, y) = 0;
    }
  }
  put_mask(0, 1, close);
  EXPECT_THAT(codes(findings()), IsEmpty());
}

TEST_F(CheckFrames, RepeatedFindingsOfACamera_AreMerged) {
  for (int f = 0; f < 6; ++f) {
    put_mask(0, f, ByteImage(40, 50, 1));
  }
  const std::vector<Finding> found = findings();
  EXPECT_THAT(codes(found), ::testing::ElementsAre("mask-empty"));
  EXPECT_THAT(found[0].what, HasSubstr("5 more of its frames"));
}

/// A person who walks past the cameras, as detections on disk.
class CheckKeypoints : public ::testing::Test {
 protected:
  static constexpr int kFrames = 24;

  CheckKeypoints() {
    dataset_.cameras = stage(8);
    dataset_.root = folder_.path();
    dataset_.info.keypoint_schema = "body_25";
    dataset_.world_convention = {1, "y"};
    CaptureSequence sequence{.name = "walk", .kind = "clothed", .fps = 30, .frame_ids = {}};
    for (int f = 0; f < kFrames; ++f) {
      sequence.frame_ids.push_back(f);
    }
    dataset_.info.sequences.push_back(sequence);
  }

  /// Joints of somebody upright, of whom the left arm swings.
  static Points person(int frame) {
    const KeypointSchema& schema = body_25_schema();
    Points points(static_cast<Index>(schema.points.size()), 3);
    const double walk = 0.04 * frame - 0.5;
    for (Index k = 0; k < points.rows(); ++k) {
      const std::string& name = schema.points[static_cast<std::size_t>(k)];
      const double side = name.starts_with("left") ? 1 : name.starts_with("right") ? -1 : 0;
      const auto place = [&](double x, double y, double z) {
        points.row(k) << side * x + 0.2 * std::sin(0.5 * frame), y, z + walk;
      };
      if (name.ends_with("shoulder")) {
        place(0.18, 1.4, 0);
      } else if (name.ends_with("elbow")) {
        place(0.3, 1.15, 0.1 * std::sin(0.7 * frame));
      } else if (name.ends_with("wrist")) {
        place(0.35, 0.92, 0.2 * std::sin(0.7 * frame));
      } else if (name.ends_with("hip")) {
        place(0.09, 0.9, 0);
      } else if (name.ends_with("knee")) {
        place(0.1, 0.48, 0.05);
      } else if (name.ends_with("ankle")) {
        place(0.1, 0.08, 0);
      } else if (name.find("toe") != std::string::npos || name.ends_with("heel")) {
        place(0.1 + 0.01 * static_cast<double>(k % 3), 0.02, name.ends_with("heel") ? -0.05 : 0.15);
      } else {
        place(0.04 * static_cast<double>(k % 3), 1.5 + 0.02 * static_cast<double>(k % 5), 0.05);
      }
    }
    return points;
  }

  std::vector<Finding> findings(const std::function<void(int c, int f, Keypoints2d&)>& spoil = {},
                                int late_camera = -1, int late = 0) {
    dataset_.frames.assign(dataset_.cameras.size(), {});
    const std::vector<Camera> cameras = stage(8);  // the detections are those of the true cameras
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      for (int f = 0; f < kFrames; ++f) {
        const int seen = static_cast<int>(c) == late_camera ? f + late : f;
        const Points points = person(seen);
        Keypoints2d rows = detected_keypoints(
            cameras[c], body_25_schema(), points,
            std::vector<KeypointSight>(static_cast<std::size_t>(points.rows())),
            {.noise = 2, .outliers = 0.02}, Random{5, c * 100 + static_cast<std::uint64_t>(f), 0});
        if (spoil) {
          spoil(static_cast<int>(c), f, rows);
        }
        const std::filesystem::path file =
            folder_.path() / (std::to_string(c) + "_" + std::to_string(f) + ".json");
        std::ofstream(file) << openpose_json({{-1, rows}});
        dataset_.frames[c].keypoints.set(f, {file, "", -1});
      }
    }
    FrameReader reader(dataset_);
    return check_keypoints(reader).findings;
  }

  TemporaryDirectory folder_;
  Dataset dataset_;
};

TEST_F(CheckKeypoints, GoodCapture_HasNoFinding) {
  EXPECT_THAT(codes(findings()), IsEmpty());
}

TEST_F(CheckKeypoints, MovedCamera_IsNamed) {
  Camera& camera = dataset_.cameras[4];
  const Eigen::Vector3d centre = camera_center(camera);
  camera.camera_from_world_rotation =
      Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY()) * camera.camera_from_world_rotation;
  camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
  EXPECT_TRUE(has(findings(), "camera-off", "cam4"));
}

TEST_F(CheckKeypoints, TransposedRotation_IsNamed) {
  dataset_.cameras[3].camera_from_world_rotation.transposeInPlace();
  EXPECT_TRUE(has(findings(), "extrinsic-transposed", "cam3"));
}

TEST_F(CheckKeypoints, CameraOutOfSync_IsNamedWithItsShift) {
  const std::vector<Finding> found = findings({}, 2, 3);
  ASSERT_TRUE(has(found, "camera-out-of-sync", "cam2")) << ::testing::PrintToString(codes(found));
  for (const Finding& finding : found) {
    if (finding.code == "camera-out-of-sync") {
      EXPECT_THAT(finding.advice, HasSubstr("shift its frames by 3"));
    }
  }
}

TEST_F(CheckKeypoints, TranslationsInMillimetres_GiveAPersonSizeFinding) {
  for (Camera& camera : dataset_.cameras) {
    camera.camera_from_world_translation *= 1000;
  }
  const std::vector<Finding> found = findings();
  ASSERT_TRUE(has(found, "person-size"));
}

TEST_F(CheckKeypoints, WrongKeypointOrder_IsFound) {
  const auto scramble = [](int /*camera*/, int /*frame*/, Keypoints2d& rows) {
    const KeypointSchema& schema = body_25_schema();
    rows.row(find_keypoint(schema, "left_knee")).swap(rows.row(find_keypoint(schema, "nose")));
  };
  EXPECT_TRUE(has(findings(scramble), "keypoint-order"));
}

TEST_F(CheckKeypoints, ScaledKeypoints_AreNamed) {
  const auto enlarge = [](int camera, int /*frame*/, Keypoints2d& rows) {
    if (camera == 1) {
      rows.leftCols(2) *= 4;
    }
  };
  EXPECT_TRUE(has(findings(enlarge), "keypoints-scaled", "cam1"));
}

TEST_F(CheckKeypoints, CamerasWithSwappedNames_AreNamed) {
  std::swap(dataset_.cameras[1].camera_from_world_rotation,
            dataset_.cameras[5].camera_from_world_rotation);
  std::swap(dataset_.cameras[1].camera_from_world_translation,
            dataset_.cameras[5].camera_from_world_translation);
  const std::vector<Finding> found = findings();
  EXPECT_TRUE(has(found, "camera-mislabelled", "cam1"));
  EXPECT_TRUE(has(found, "camera-mislabelled", "cam5"));
}

TEST_F(CheckKeypoints, CalibrationOfOtherRig_IsFound) {
  Random random{3, 0, 0};
  for (Camera& camera : dataset_.cameras) {
    camera.camera_from_world_rotation =
        Eigen::AngleAxisd(uniform(random, -0.5, 0.5), Eigen::Vector3d::UnitX()) *
        camera.camera_from_world_rotation;
  }
  EXPECT_TRUE(has(findings(), "calibration-error"));
}

TEST_F(CheckKeypoints, WrongKeypointCount_IsFound) {
  dataset_.info.keypoint_schema = "coco_17";
  EXPECT_TRUE(has(findings(), "keypoint-count"));
}

}  // namespace
}  // namespace atelier::fixtures
