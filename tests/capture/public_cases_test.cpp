// Captures as people have them, which once came out wrong: tests/capture/cases has the files of
// some, the others are written here.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/camera_conventions.h"
#include "capture/frame_reader.h"
#include "capture/layouts/camera_toml.h"
#include "capture/layouts/colmap.h"
#include "capture/layouts/nerfstudio.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/qualisys.h"
#include "capture/layouts/write_layout.h"
#include "capture/radial_fit.h"
#include "capture/try_corrections.h"
#include "capture/validate.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/npz.h"
#include "core/usage_error.h"
#include "tests/capture/circle_of_cameras.h"
#include "tests/capture/finding_of.h"
#include "tests/capture/oriented_jpeg.h"
#include "tests/capture/small_capture.h"
#include "tests/support/places.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using fixtures::finding_of;
using ::testing::HasSubstr;

fs::path case_folder(const std::string& name) {
  return fixtures::source_directory() / "tests" / "capture" / "cases" / name;
}

/// Rows of an array [N,2].
RowMatrix pixels_of_case(const Npz& npz, const std::string& name) {
  return matrix_of(npz.read(name), 2, npz.file(), name);
}

/// Largest distance of a case's pixels from the images of the points at which their rays meet.
double worst_meeting(const std::vector<Camera>& cameras, const Npz& expected,
                     const std::vector<std::string>& names) {
  std::vector<RowMatrix> pixels;
  for (const std::string& name : names) {
    pixels.push_back(pixels_of_case(expected, name));
  }
  double worst = 0;
  for (Index i = 0; i < pixels.front().rows(); ++i) {
    Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const auto ray = ray_direction(cameras[c], pixels[c].row(i).transpose());
      if (!ray) {
        return HUGE_VAL;
      }
      const Eigen::Matrix3d off = Eigen::Matrix3d::Identity() - *ray * ray->transpose();
      across += off;
      right += off * camera_center(cameras[c]);
    }
    const Eigen::Vector3d point = across.ldlt().solve(right);
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const auto pixel = project(cameras[c], point);
      worst = std::max(worst, pixel ? (*pixel - pixels[c].row(i).transpose()).norm() : HUGE_VAL);
    }
  }
  return worst;
}

TEST(PublicCases, FourthCoefficientOfNerfstudio_IsThatOfAPolynomial) {
  const Dataset dataset = open_dataset(case_folder("21-nerfstudio-opencv-k4"));
  ASSERT_EQ(dataset.cameras.size(), 4U);
  EXPECT_NE(finding_of(dataset.findings, "lens-refitted"), nullptr);
  const Npz expected(case_folder("21-nerfstudio-opencv-k4") / "expected.npz");
  EXPECT_LT(worst_meeting(dataset.cameras, expected, {"a_view", "b_view", "c_view", "d_view"}),
            1e-3);
  // Against the formula itself, up to the image's corners.
  const Camera& camera = dataset.cameras.front();
  for (double r = 0.01; r < 0.7; r += 0.01) {
    const double u = r * r;
    const double factor = 1 + u * (-0.15 + u * (0.05 + u * (0.02 + u * 0.4)));
    const Eigen::Vector3d point =
        camera_center(camera) +
        camera.camera_from_world_rotation.transpose() * Eigen::Vector3d(0.8 * r, 0.6 * r, 1);
    const auto pixel = project(camera, point);
    ASSERT_TRUE(pixel) << r;
    EXPECT_NEAR(pixel->x(), 320 + 600 * 0.8 * r * factor, 1e-3) << r;
    EXPECT_NEAR(pixel->y(), 240 + 600 * 0.6 * r * factor, 1e-3) << r;
  }
}

TEST(PublicCases, IsFisheyeOfInstantNgp_IsAnEquidistantFisheye) {
  const Dataset dataset = open_dataset(case_folder("22-ngp-is-fisheye"));
  ASSERT_EQ(dataset.cameras.size(), 4U);
  EXPECT_EQ(dataset.cameras[0].distortion_model, Distortion::Fisheye);
  const Npz expected(case_folder("22-ngp-is-fisheye") / "expected.npz");
  EXPECT_LT(worst_meeting(dataset.cameras, expected, {"a_view", "b_view", "c_view", "d_view"}),
            1e-6);
}

// nerfstudio's dataparser takes the six coefficients as one list, of the frame or of the file, too.
TEST(Transforms, ListedDistortion_IsThatOfItsNames) {
  const auto lens_of = [](const std::string& file, const std::string& frame) {
    const Camera camera = parse_transforms("{\"w\": 640, \"h\": 480, \"fl_x\": 500, " + file +
                                               "\"frames\": [{\"file_path\": \"a.png\", " + frame +
                                               "\"transform_matrix\": "
                                               "[[1,0,0,0],[0,1,0,0],[0,0,1,2],[0,0,0,1]]}]}",
                                           "transforms.json")
                              .front()
                              .camera;
    return std::pair(camera.distortion_model, camera.distortion);
  };
  const std::string names =
      "\"k1\": -0.15, \"k2\": 0.05, \"k3\": 0.02, \"p1\": 0.001, \"p2\": 0.002, ";
  const std::string list = "\"distortion_params\": [-0.15, 0.05, 0.02, 0, 0.001, 0.002], ";
  const auto named = lens_of(names, "");
  EXPECT_EQ(named.first, Distortion::Brown);
  EXPECT_EQ(lens_of(list, ""), named);
  EXPECT_EQ(lens_of("", list), named);
  const std::string fisheye = "\"camera_model\": \"OPENCV_FISHEYE\", ";
  EXPECT_EQ(lens_of(fisheye + list, ""), lens_of(fisheye + names, ""));
  ATELIER_EXPECT_REFUSED(lens_of("\"distortion_params\": [0.1, 0.2], ", ""), DataError,
                         "2 numbers; expected k1, k2, k3, k4, p1 and p2");
}

// What instant-ngp's loader takes beside fl_x, and what is no perspective image.
TEST(Transforms, FieldsOfInstantNgp_AreReadOrRefused) {
  const std::string pose = "[[1,0,0,0],[0,1,0,0],[0,0,1,2],[0,0,0,1]]";
  const std::string moved = "[[1,0,0,0.1],[0,1,0,0],[0,0,1,2],[0,0,0,1]]";
  const auto read = [&](const std::string& lens, const std::string& matrix) {
    return parse_transforms("{\"w\": 640, \"h\": 480, " + lens +
                                "\"frames\": [{\"file_path\": \"a.png\", " + matrix + "}]}",
                            "transforms.json")
        .front()
        .camera;
  };
  const std::string still = "\"transform_matrix\": " + pose;
  const double half = std::tan(0.25);  // of 0.5 rad
  const Camera both = read("\"camera_angle_x\": 0.5, \"camera_angle_y\": 0.5, ", still);
  EXPECT_NEAR(both.fx, 320 / half, 1e-9);
  EXPECT_NEAR(both.fy, 240 / half, 1e-9);
  const Camera one = read("\"camera_angle_x\": 0.5, ", still);
  EXPECT_EQ(one.fy, one.fx);
  const Camera degrees = read("\"x_fov\": 90, \"fl_x\": 7, ", still);
  EXPECT_NEAR(degrees.fx, 320, 1e-9);
  EXPECT_NEAR(degrees.fy, 320, 1e-9);
  EXPECT_NEAR(read("\"y_fov\": 90, ", still).fx, 240, 1e-9);
  const std::string focal = "\"fl_x\": 500, ";
  ATELIER_EXPECT_REFUSED(read(focal + "\"fl_y\": -500, ", still), DataError, "a negative focal");
  ATELIER_EXPECT_REFUSED(read(focal + "\"latlong\": true, ", still), DataError, "a panorama");
  ATELIER_EXPECT_REFUSED(read(focal + "\"equirectangular\": 1, ", still), DataError, "a panorama");
  ATELIER_EXPECT_REFUSED(read(focal + "\"k1\": 0.1, \"k5\": 0.2, ", still), DataError, "k5");
  EXPECT_EQ(read(focal + "\"k1\": 0.1, \"k5\": 0, \"k6\": 0.0, ", still).distortion[0], 0.1);
  const std::string begin = "\"transform_matrix_start\": ";
  const std::string end = ", \"transform_matrix_end\": ";
  EXPECT_EQ(read(focal, begin + pose + end + pose).camera_from_world_translation,
            read(focal, still).camera_from_world_translation);
  ATELIER_EXPECT_REFUSED(read(focal, begin + pose + end + moved), DataError, "rolling shutter");
}

TEST(PublicCases, RationalLens_GoesToNerfstudioAsAPolynomial) {
  fixtures::TemporaryDirectory folder;
  fixtures::SmallCapture small;
  for (Camera& camera : small.cameras) {
    camera.distortion_model = Distortion::Brown;
    camera.distortion = {0.3, 0.05, 0.001, -0.002, 0.01, 0.45, 0.1, 0.02};
  }
  fixtures::write_small_capture(folder / "capture", small);
  const fs::path written =
      write_layout(folder / "capture", "nerfstudio", folder / "nerfstudio").folders.front();
  const Dataset back = open_dataset(written);
  ASSERT_EQ(back.cameras.size(), small.cameras.size());
  for (std::size_t c = 0; c < back.cameras.size(); ++c) {
    const Camera& camera = small.cameras[c];
    for (const auto& [x, y] : {std::pair{1.0, 1.0}, {32.0, 40.0}, {63.0, 5.0}, {10.0, 79.0}}) {
      const auto ray = ray_direction(camera, {x, y});
      ASSERT_TRUE(ray);
      const auto pixel = project(back.cameras[c], camera_center(back.cameras[c]) + *ray);
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - Eigen::Vector2d(x, y)).norm(), 1e-3);
    }
  }
}

TEST(PublicCases, RationalLens_IsRefittedWhereALayoutHasFiveNumbers) {
  Camera camera;
  camera.width = 1000;
  camera.height = 800;
  camera.fx = camera.fy = 900;
  camera.cx = 500;
  camera.cy = 400;
  camera.distortion_model = Distortion::Brown;
  camera.distortion = {0.3, 0.05, 0, 0, 0.01, 0.45, 0.1, 0.02};
  std::vector<std::string> lost;
  const std::array<double, 5> d = five_distortion(camera, lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_THAT(lost.front(), HasSubstr("off by up to"));
  Camera five = camera;
  five.distortion = {d[0], d[1], d[2], d[3], d[4], 0, 0, 0};
  for (double r = 0; r < 0.7; r += 0.05) {
    const Eigen::Vector3d point(0.6 * r, -0.8 * r, 1);
    EXPECT_LT((*project(camera, point) - *project(five, point)).norm(), 0.05) << r;
  }
}

TEST(PublicCases, CaliscopeCameraWithNullPose_IsLeftOut) {
  const Dataset dataset = open_dataset(case_folder("26-caliscope-null-pose"));
  ASSERT_EQ(dataset.cameras.size(), 3U);
  const Finding* finding = finding_of(dataset.findings, "camera-left-out");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->place, "3");
  EXPECT_THAT(finding->what, HasSubstr("it has no pose"));
  Npz expected(case_folder("26-caliscope-null-pose") / "expected.npz");
  std::vector<std::string> names;
  for (const Camera& camera : dataset.cameras) {
    names.push_back(camera.id);
  }
  // The file counts from the first pixel's centre, the case's pixels are ours.
  EXPECT_LT(worst_meeting(dataset.cameras, expected, names), 1e-6);
}

TEST(PublicCases, NullPosesOfOtherLayouts_LeaveTheirCamerasOut) {
  fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  const auto without_pose = [&](const std::string& layout, const std::string& file,
                                const std::string& key) {
    const fs::path written =
        write_layout(folder / "capture", layout, folder / layout).folders.front();
    const fs::path path = written / file;
    std::string text = read_file_text(path, 1 << 24);
    const std::size_t at = text.find("\"" + key + "\"");
    const std::size_t from = text.find('[', at);
    int depth = 0;
    std::size_t to = from;
    do {
      depth += text[to] == '[' ? 1 : text[to] == ']' ? -1 : 0;
      ++to;
    } while (depth > 0);
    write_file_atomically(path, text.replace(from, to - from, "null"));
    const Dataset dataset = open_dataset(written);
    EXPECT_EQ(dataset.cameras.size(), 2U) << layout;
    const Finding* finding = finding_of(dataset.findings, "camera-left-out");
    ASSERT_NE(finding, nullptr) << layout;
    EXPECT_THAT(finding->what, HasSubstr("no pose")) << layout;
  };
  without_pose("avatarrex", "calibration_full.json", "R");
  without_pose("thuman4", "calibration.json", "T");
  without_pose("mvhumannet", "camera_extrinsics.json", "rotation");
  without_pose("goliath", "camera_calibration.json", "T");
}

TEST(PublicCases, ViewRotationOfQualisys_IsNamedAndCanBeCorrected) {
  const std::string text =
      read_file_text(case_folder("27-qualisys-viewrotation") / "qtm.qca.txt", 1 << 20);
  EXPECT_EQ(parse_qualisys(text).view_rotation, (std::vector<int>{90, 270, 0, 0}));
  fixtures::TemporaryDirectory folder;
  fs::create_directories(folder / "calibration");
  write_file_atomically(folder / "calibration" / "qtm.qca.txt", text);
  for (const char* id : {"26578", "26579", "26580", "26581"}) {
    const bool turned = std::string(id) < "26580";
    fs::create_directories(folder / "images" / id);
    write_image(folder / "images" / id / "000001.png",
                turned ? ByteImage(1088 / 8, 1920 / 8, 1) : ByteImage(1920 / 8, 1088 / 8, 1));
  }
  const Dataset dataset = open_dataset(folder.path());
  std::vector<std::string> named;
  for (const Finding& finding : dataset.findings) {
    EXPECT_NE(finding.code, "image-size") << finding.what;
    if (finding.code == "image-turned") {
      EXPECT_EQ(finding.severity, Severity::Error);
      EXPECT_THAT(finding.what, HasSubstr("viewrotation"));
      named.push_back(finding.place);
    }
  }
  EXPECT_EQ(named, (std::vector<std::string>{"26578", "26579"}));
  DatasetOptions options;
  options.corrections.turned = "26578=90,26579=270";
  const Dataset corrected = open_dataset(folder.path(), options);
  EXPECT_EQ(finding_of(corrected.findings, "image-turned"), nullptr);
  options.corrections.turned = "26578=270,26579=90";
  const Dataset wrong = open_dataset(folder.path(), options);
  for (const char* id : {"26578", "26579"}) {
    EXPECT_TRUE(std::any_of(wrong.findings.begin(), wrong.findings.end(), [&](const Finding& f) {
      return f.code == "image-turned" && f.place == id && f.severity == Severity::Warning &&
             f.what.find("the other way than the recorder") != std::string::npos;
    })) << id;
  }
  options.corrections.turned = "26578=90,26579=270,26580=180";
  const Dataset third = open_dataset(folder.path(), options);
  EXPECT_NE(finding_of(third.findings, "image-upside-down"), nullptr);
  EXPECT_EQ(corrected.cameras[0].width, 136);
  EXPECT_EQ(corrected.cameras[0].height, 240);
  ATELIER_EXPECT_REFUSED(parse_qualisys(std::string(text).replace(text.find("viewrotation=\"90\""),
                                                                  17, "viewrotation=\"45\"")),
                         DataError, "0, 90, 180 or 270");
}

// Half a turn keeps the size of the images, so that no size tells whether they were turned.
TEST(PublicCases, ViewRotationByHalf_IsAnErrorUntilItIsSaid) {
  std::string text =
      read_file_text(case_folder("27-qualisys-viewrotation") / "qtm.qca.txt", 1 << 20);
  for (const char* quarter : {"viewrotation=\"90\"", "viewrotation=\"270\""}) {
    text.replace(text.find(quarter), std::string(quarter).size(), "viewrotation=\"180\"");
  }
  fixtures::TemporaryDirectory folder;
  fs::create_directories(folder / "calibration");
  write_file_atomically(folder / "calibration" / "qtm.qca.txt", text);
  for (const char* id : {"26578", "26579", "26580", "26581"}) {
    fs::create_directories(folder / "images" / id);
    write_image(folder / "images" / id / "000001.png", ByteImage(1920 / 8, 1088 / 8, 1));
  }
  const auto opened = [&](const std::string& turned) {
    DatasetOptions options;
    options.corrections.turned = turned;
    return open_dataset(folder.path(), options);
  };
  const Dataset unsaid = opened("");
  std::vector<std::string> named;
  for (const Finding& finding : unsaid.findings) {
    if (finding.code == "image-turned") {
      EXPECT_EQ(finding.severity, Severity::Error);
      EXPECT_THAT(finding.what, HasSubstr("viewrotation"));
      EXPECT_THAT(finding.advice, HasSubstr("say --capture.turned " + finding.place + "=180"));
      EXPECT_THAT(finding.advice, HasSubstr("--capture.turned " + finding.place + "=0"));
      named.push_back(finding.place);
    }
  }
  EXPECT_EQ(named, (std::vector<std::string>{"26578", "26579"}));
  const Dataset turned = opened("26578=180,26579=180");
  const Dataset left = opened("26578=0,26579=0");
  for (std::size_t c = 0; c < 2; ++c) {
    const Camera& there = unsaid.cameras[c];
    const Eigen::Vector3d point =
        camera_center(there) +
        there.camera_from_world_rotation.transpose() * Eigen::Vector3d(0.3, -0.2, 3);
    const Eigen::Vector2d pixel = *project(there, point);
    const Eigen::Vector2d half = *project(turned.cameras[c], point);
    EXPECT_NEAR(half.x(), 240 - pixel.x(), 1e-9);
    EXPECT_NEAR(half.y(), 136 - pixel.y(), 1e-9);
    EXPECT_LT((*project(left.cameras[c], point) - pixel).norm(), 1e-9);
  }
  EXPECT_EQ(finding_of(left.findings, "image-turned"), nullptr);
}

TEST(TurnedCamera, Pixels_AreThoseOfTheTurnedImage) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 600;
  camera.fy = 610;
  camera.cx = 330;
  camera.cy = 250;
  camera.camera_from_world_rotation = rotation_of_vector({0.3, -0.7, 0.5});
  camera.camera_from_world_translation = {0.4, -0.2, 3};
  for (const bool fisheye : {false, true}) {
    camera.distortion_model = fisheye ? Distortion::Fisheye : Distortion::Brown;
    camera.distortion = fisheye ? std::array<double, 8>{0.05, 0.01, 0.002, 0.001}
                                : std::array<double, 8>{-0.1, 0.02, 0.003, -0.004, 0.01};
    for (const Eigen::Vector3d& point : {Eigen::Vector3d(0.1, 0.2, 0.3), {-0.5, 0.4, -0.2}}) {
      const Eigen::Vector2d pixel = *project(camera, point);
      const Eigen::Vector2d once = *project(turned_camera(camera, 1), point);
      EXPECT_NEAR(once.x(), 480 - pixel.y(), 1e-9);
      EXPECT_NEAR(once.y(), pixel.x(), 1e-9);
      const Eigen::Vector2d twice = *project(turned_camera(camera, 2), point);
      EXPECT_NEAR(twice.x(), 640 - pixel.x(), 1e-9);
      EXPECT_NEAR(twice.y(), 480 - pixel.y(), 1e-9);
      EXPECT_LT((*project(turned_camera(camera, 4), point) - pixel).norm(), 1e-9);
      EXPECT_LT((*project(turned_camera(turned_camera(camera, 1), -1), point) - pixel).norm(),
                1e-9);
    }
  }
}

TEST(PublicCases, ExifOrientation_IsNamedAndCanBeCorrected) {
  fixtures::TemporaryDirectory folder;
  fixtures::SmallCapture small;
  fixtures::write_small_capture(folder / "capture", small);
  const auto opened = [&](int width, int height, char orientation, const std::string& turned) {
    for (const Camera& camera : small.cameras) {
      for (const int frame : small.frames) {
        const fs::path stem = folder / "capture" / "images" / camera.id / frame_name(frame);
        fs::remove(stem.string() + ".png");
        fs::remove(stem.string() + ".jpg");
        fixtures::write_oriented(stem.string() + ".jpg", width, height, orientation);
      }
    }
    DatasetOptions options;
    options.corrections.turned = turned;
    return open_dataset(folder / "capture", options);
  };
  // Stored lying, shown upright by a clockwise quarter; calibrated as it is shown: 64 x 80.
  const Dataset lying = opened(80, 64, 6, "");
  const Finding* finding = finding_of(lying.findings, "image-turned");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->what, HasSubstr("EXIF"));
  EXPECT_EQ(finding->setting, "--capture.turned " + small.cameras[0].id + "=270");
  const Dataset corrected = opened(80, 64, 6, "all=270");
  EXPECT_EQ(finding_of(corrected.findings, "image-turned"), nullptr);
  const Eigen::Vector3d point(0.1, 1.1, 0.05);
  const Eigen::Vector2d upright = *project(small.cameras[0], point);
  const Eigen::Vector2d stored = *project(corrected.cameras[0], point);
  EXPECT_NEAR(stored.x(), upright.y(), 1e-9);
  EXPECT_NEAR(stored.y(), 64 - upright.x(), 1e-9);
  // Set otherwise than EXIF and size say.
  const Dataset wrong_way = opened(80, 64, 6, "all=90");
  finding = finding_of(wrong_way.findings, "image-turned");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->severity, Severity::Error);
  EXPECT_THAT(finding->what,
              HasSubstr("--capture.turned all=90 turns its images by 90 degrees, and "
                        "their EXIF (orientation 6) and size say 270 degrees"));
  finding = finding_of(opened(64, 80, 6, "all=180").findings, "image-turned");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->what, HasSubstr("say that they were not turned"));
  EXPECT_EQ(finding_of(opened(64, 80, 3, "all=180").findings, "image-turned"), nullptr);
  const auto reopen = [&](const std::map<std::string, std::string>& corrections) {
    DatasetOptions options;
    options.corrections = corrections_of(corrections);
    return open_dataset(folder / "capture", options);
  };
  opened(80, 64, 6, "");
  const Dataset tried = without_wrong_corrections(reopen({{"turned", "all=90"}}), reopen);
  finding = finding_of(tried.findings, "correction-wrong");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->what,
              HasSubstr("--capture.turned all=90 makes it worse: the calibration has 3 errors"));
  EXPECT_THAT(finding->advice, HasSubstr("say --capture.turned all=270 instead"));
  EXPECT_EQ(finding_of(tried.findings, "image-turned"), nullptr);
  // Of the calibration's size, and upright in it: it is of the images as they are shown.
  const Dataset upside_down = opened(64, 80, 3, "");
  finding = finding_of(upside_down.findings, "image-turned");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->setting, "--capture.turned " + small.cameras[0].id + "=180");
  EXPECT_THAT(finding->what, HasSubstr("it was calibrated as they are shown"));
  EXPECT_EQ(finding_of(opened(64, 80, 3, "all=0").findings, "image-turned"), nullptr);
  // No turn makes mirrored images of lying ones.
  for (const char mirrored : {5, 7}) {
    const Dataset dataset = opened(80, 64, mirrored, "");
    finding = finding_of(dataset.findings, "image-turned");
    ASSERT_NE(finding, nullptr);
    EXPECT_THAT(finding->what, HasSubstr("turned and mirrored"));
    EXPECT_EQ(finding->setting, "");
  }
  EXPECT_EQ(finding_of(opened(64, 80, 1, "").findings, "image-orientation"), nullptr);
}

TEST(PublicCases, KeypointsOfMmpose_AreReadAsThoseOfOpenpose) {
  const Dataset good = open_dataset(case_folder("29-keypoints/good"));
  const Dataset mmpose = open_dataset(case_folder("29-keypoints/mmpose"));
  EXPECT_EQ(mmpose.info.keypoint_schema, "halpe_26");
  ASSERT_EQ(good.info.keypoint_schema, "halpe_26");
  FrameReader as_good(good);
  FrameReader as_mmpose(mmpose);
  for (Index c = 0; c < 4; ++c) {
    const auto one = as_good.keypoints(c, 1);
    const auto other = as_mmpose.keypoints(c, 1);
    ASSERT_EQ(other.size(), 1U);
    EXPECT_LT((one[0].points - other[0].points).norm(), 1e-6);
  }
}

TEST(PublicCases, FilesWithoutADetection_AreNamed) {
  const Dataset dataset = open_dataset(case_folder("29-keypoints/empty"));
  const Finding* finding = finding_of(dataset.findings, "keypoints-none");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->what, HasSubstr("no detection"));
  FrameReader reader(dataset);
  const Validation validation = validate(reader);
  EXPECT_EQ(std::count_if(validation.findings.begin(), validation.findings.end(),
                          [](const Finding& one) { return one.code == "keypoints-none"; }),
            1);
}

TEST(PublicCases, ReadingOfAllCameras_IsAWholeSentence) {
  Dataset dataset = open_dataset(case_folder("29-keypoints/good"));
  for (Camera& camera : dataset.cameras) {
    std::swap(camera.cx, camera.cy);
  }
  FrameReader reader(dataset);
  const Validation validation = validate(reader);
  const Finding* finding = finding_of(validation.findings, "principal-point-swapped");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->what, HasSubstr("x and y of each camera's principal point are"));
}

// Some detectors write -1 for what they did not find, and a confidence all the same.
TEST(PublicCases, KeypointsBesideTheImage_AreNotTakenForShares) {
  fixtures::TemporaryDirectory folder;
  fs::copy(case_folder("29-keypoints/good"), folder / "capture", fs::copy_options::recursive);
  for (const auto& entry : fs::recursive_directory_iterator(folder / "capture" / "pose")) {
    if (entry.is_regular_file()) {
      std::vector<PersonKeypoints> people =
          parse_openpose(read_file_text(entry.path(), 1 << 20), "people.json");
      for (PersonKeypoints& person : people) {
        person.points.leftCols(2).setConstant(-1);
      }
      write_file_atomically(entry.path(), openpose_json(people));
    }
  }
  FrameReader reader(open_dataset(folder / "capture"));
  const Validation validation = validate(reader);
  EXPECT_EQ(finding_of(validation.findings, "keypoints-scaled"), nullptr);
  EXPECT_NE(finding_of(validation.findings, "keypoints-outside"), nullptr);
}

// kapture writes commas behind the columns, as the comment of COLMAP's own files has them.
TEST(ColmapText, CommasBehindColumns_AreRead) {
  const auto cameras = parse_colmap_cameras_text("1, PINHOLE, 640, 480, 300, 310, 320, 240\n");
  EXPECT_EQ(cameras.at(1).fy, 310);
  const std::vector<ColmapImage> images =
      parse_colmap_images_text("7, 1.0, 0, 0, 0, 0.1, 0.2, 3, 1, right/frame_1, a.png\n\n");
  ASSERT_EQ(images.size(), 1U);
  EXPECT_EQ(images[0].id, 7U);
  EXPECT_EQ(images[0].camera_from_world_translation, Eigen::Vector3d(0.1, 0.2, 3));
  EXPECT_EQ(images[0].name, "right/frame_1, a.png");
}

TEST(Detections, NanAsPythonWritesIt_IsAKeypointNotFound) {
  const Keypoints2d expected = (Keypoints2d(2, 3) << 0, 0, 0, 3.5, 4.5, 0.25).finished();
  for (const char* text : {
           R"({"people": [{"pose_keypoints_2d": [NaN, 2, 0.5, 3, 4, 0.25]}]})",
           R"({"people": [{"pose_keypoints_2d": [1, 2, NaN, 3, 4, 0.25]}]})",
           R"({"people": [{"pose_keypoints_2d": [Infinity, -Infinity, 0.5, 3, 4, 0.25]}]})",
           R"([{"keypoints": [[1, NaN], [3, 4]], "keypoint_scores": [0.5, 0.25]}])",
           R"([{"image_id": "NaN7.jpg", "keypoints": [NaN,NaN,NaN,3,4,0.25], "score": NaN}])",
       }) {
    const auto people = parse_detections(text, "d.json", 0.5);
    ASSERT_EQ(people.size(), 1U) << text;
    EXPECT_EQ(people[0].points, expected) << text;
  }
  EXPECT_EQ(parse_easymocap_annotation(R"([{"id": 1, "keypoints": [[NaN, 2, 0.5], [3, 4, 0.25]]}])",
                                       "a.json")[0]
                .points,
            expected);
  ATELIER_EXPECT_REFUSED(parse_detections(R"({"people": [{"person_id": [NaN],
                         "pose_keypoints_2d": [1, 2, 0.5]}]})"),
                         DataError, "person_id");
  ATELIER_EXPECT_REFUSED(
      parse_openpose(R"({"people": [{"pose_keypoints_2d": [NaN, 2, 0.5, null]}]})"), DataError,
      "pose_keypoints_2d[3]: null");
}

TEST(Detections, DataSetOfCoco_IsReadByItsImages) {
  const auto frames = parse_detection_frames(
      R"({"info": {}, "images": [{"id": 70, "file_name": "cam/000003.jpg"},
          {"id": 71, "file_name": "cam/000005.jpg"}, {"id": 72, "file_name": "cam/000006.jpg"}],
          "annotations": [
            {"id": 1, "image_id": 71, "category_id": 1, "keypoints": [1, 2, 2, 3, 4, 1],
             "num_keypoints": 2},
            {"id": 2, "image_id": 70, "category_id": 1, "keypoints": [5, 6, 2, 0, 0, 0]},
            {"id": 3, "image_id": 70, "category_id": 1, "keypoints": [0, 0, 0, 0, 0, 0]},
            {"id": 4, "image_id": 70, "category_id": 9, "bbox": [1, 2, 3, 4]}],
          "categories": [{"id": 1, "keypoints": ["a", "b"]}]})");
  ASSERT_EQ(frames.size(), 3U);
  ASSERT_EQ(frames.at(3).size(), 1U);
  EXPECT_EQ(frames.at(3)[0].points, (Keypoints2d(2, 3) << 5, 6, 1, 0, 0, 0).finished());
  ASSERT_EQ(frames.at(5).size(), 1U);
  EXPECT_EQ(frames.at(5)[0].points, (Keypoints2d(2, 3) << 1, 2, 1, 3, 4, 0.5).finished());
  EXPECT_TRUE(frames.at(6).empty());
  const auto scored = parse_detections(
      R"({"images": [{"id": 1, "file_name": "1.jpg"}],
          "annotations": [{"image_id": 1, "keypoints": [5, 6, 0.75]}]})");
  ASSERT_EQ(scored.size(), 1U);
  EXPECT_EQ(scored[0].points(0, 2), 0.75);
  ATELIER_EXPECT_REFUSED(parse_detection_frames(R"({"images": [{"id": 1, "file_name": "a/1.jpg"},
                             {"id": 2, "file_name": "b/1.jpg"}], "annotations": []})"),
                         DataError, "frame 1 a second time");
  ATELIER_EXPECT_REFUSED(
      parse_detection_frames(
          R"({"images": [], "annotations": [{"image_id": 5, "keypoints": []}]})"),
      DataError, "image 5");
}

TEST(Detections, EveryProgramsFile_IsRead) {
  const auto only = [](const std::string& text) {
    const auto people = parse_detections(text, "d.json");
    EXPECT_EQ(people.size(), 1U) << text;
    return people.front();
  };
  const Keypoints2d expected = (Keypoints2d(2, 3) << 1, 2, 0.5, 3, 4, 0.25).finished();
  for (
      const char* text : {
          R"({"people": [{"pose_keypoints_2d": [1, 2, 0.5, 3, 4, 0.25]}]})",
          R"([{"keypoints": [[1, 2], [3, 4]], "keypoint_scores": [0.5, 0.25], "bbox": [[0, 0, 9, 9]]}])",
          R"([{"image_id": "7.jpg", "keypoints": [1, 2, 0.5, 3, 4, 0.25], "score": 2.1}])",
          R"({"meta_info": {}, "instance_info": [{"frame_id": 3, "instances":
              [{"keypoints": [[1, 2], [3, 4]], "keypoint_scores": [0.5, 0.25]}]}]})",
          R"({"5.jpg": {"version": 0.1, "bodies": [{"joints": [1, 2, 0.5, 3, 4, 0.25]}]}})",
          R"({"a/00000103.jpg": [{"keypoints": [1, 2, 0.5, 3, 4, 0.25], "score": 8.4}]})",
      }) {
    EXPECT_EQ(only(text).points, expected) << text;
  }
  const auto frames = parse_detection_frames(
      R"([{"image_id": "000004.jpg", "keypoints": [1, 2, 0.5], "idx": 2},
          {"image_id": "000004.jpg", "keypoints": [5, 6, 0.5], "idx": 3},
          {"image_id": "000006.jpg", "keypoints": [7, 8, 0.5]}])");
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames.at(4).size(), 2U);
  EXPECT_EQ(frames.at(4)[1].id, 3);
  EXPECT_EQ(frames.at(6)[0].points(0, 0), 7);
  ATELIER_EXPECT_REFUSED(parse_detections(R"({"landmarks": []})", "d.json"), DataError, "MMPose");
  ATELIER_EXPECT_REFUSED(
      parse_detections(R"([{"keypoints": [[1, 2]], "keypoint_scores": [1, 2]}])", "d.json"),
      DataError, "as many of both");
}

TEST(Detections, OneFileOfACamera_HoldsItsFrames) {
  fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  const fs::path images =
      write_layout(folder / "capture", "pose2sim", folder / "pose2sim").folders.front();
  fs::remove_all(images / "pose");
  fs::create_directories(images / "pose");
  for (const char* id : {"00", "01", "02"}) {
    std::string text = "[";
    for (const char* image : {"000000.png", "000001.png"}) {
      text += text.size() > 1 ? "," : "";
      text += "{\"image_id\": \"" + std::string(image) + "\", \"keypoints\": [";
      for (int k = 0; k < 17; ++k) {
        text += (k > 0 ? "," : "") + std::to_string(10 + k) + ",20,0.9";
      }
      text += "]}";
    }
    write_file_atomically(images / "pose" / (std::string(id) + ".json"), text + "]");
  }
  FrameReader reader(open_dataset(images));
  EXPECT_EQ(reader.dataset().frames[1].keypoints.size(), 2U);
  const auto people = reader.keypoints(1, 1);
  ASSERT_EQ(people.size(), 1U);
  EXPECT_EQ(people[0].points(3, 0), 13.5);
}

TEST(CameraOf, LongDistortionsWithoutPrism_AreRead) {
  OpencvCamera camera;
  camera.matrix << 600, 0, 320, 0, 600, 240, 0, 0, 1;
  camera.distortion = {0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6, 0, 0, 0, 0};
  EXPECT_EQ(camera_of(camera, "f").distortion,
            (std::array<double, 8>{0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6}));
  camera.distortion.resize(14);
  EXPECT_EQ(camera_of(camera, "f").distortion[7], 0.6);
  camera.distortion[9] = 1e-3;
  ATELIER_EXPECT_REFUSED(camera_of(camera, "f"), DataError, "thin prism");
  camera.fisheye = true;
  camera.distortion = {0.1, 0.2, 0.3, 0.4, 0};
  EXPECT_EQ(camera_of(camera, "f").distortion_model, Distortion::Fisheye);
  camera.distortion[4] = 0.1;
  ATELIER_EXPECT_REFUSED(camera_of(camera, "f"), DataError, "4 (fisheye)");
  camera.distortion = {0.1, 0.2, 0.3};
  ATELIER_EXPECT_REFUSED(camera_of(camera, "f"), DataError, "3 coefficients");
}

TEST(ColmapModels, NewerFisheyesAndEmptyPrisms_AreRead) {
  const auto cameras = parse_colmap_cameras_text(
      "1 SIMPLE_FISHEYE 640 480 300 320 240\n"
      "2 FISHEYE 640 480 300 310 320 240\n"
      "3 THIN_PRISM_FISHEYE 640 480 300 310 320 240 0.1 0.2 0 0 0.3 0.4 0 0\n"
      "4 SIMPLE_DIVISION 640 480 300 320 240 0\n");
  EXPECT_EQ(cameras.at(1).distortion_model, Distortion::Fisheye);
  EXPECT_EQ(cameras.at(1).fy, 300);
  EXPECT_EQ(cameras.at(2).fy, 310);
  EXPECT_EQ(cameras.at(3).distortion, (std::array<double, 8>{0.1, 0.2, 0.3, 0.4}));
  EXPECT_EQ(cameras.at(4).distortion_model, Distortion::None);
  // Equidistant: the radius is the angle.
  Camera camera = cameras.at(1);
  const auto pixel = project(camera, {std::tan(0.8), 0, 1});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 320 + 300 * 0.8, 1e-9);
  ATELIER_EXPECT_REFUSED(parse_colmap_cameras_text("1 SIMPLE_DIVISION 640 480 300 320 240 -0.1\n"),
                         DataError, "SIMPLE_DIVISION with -0.1");
  ATELIER_EXPECT_REFUSED(
      parse_colmap_cameras_text(
          "1 THIN_PRISM_FISHEYE 640 480 300 310 320 240 0.1 0.2 0.01 0 0.3 0.4 0 0\n"),
      DataError, "THIN_PRISM_FISHEYE");
}

TEST(ColmapModels, ModelOfRigs_ReadsAsOneWithout) {
  fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  const fs::path model =
      write_layout(folder / "capture", "colmap", folder / "colmap").folders.front();
  const Dataset plain = open_dataset(model);
  write_file_atomically(model / "sparse" / "0" / "rigs.txt",
                        "# Rig calib list\n1 2 CAMERA 1 CAMERA 2 1 1 0 0 0 -0.1 0 0\n");
  write_file_atomically(model / "sparse" / "0" / "frames.txt",
                        "# Frame list\n1 1 1 0 0 0 0 0 0 2 CAMERA 1 1 CAMERA 2 2\n");
  const Dataset rigs = open_dataset(model);
  ASSERT_EQ(rigs.cameras.size(), plain.cameras.size());
  for (std::size_t c = 0; c < rigs.cameras.size(); ++c) {
    EXPECT_EQ(camera_center(rigs.cameras[c]), camera_center(plain.cameras[c]));
  }
}

TEST(FreeMoCap, CalibrationOfItsOwnName_IsInMillimetres) {
  fixtures::TemporaryDirectory folder;
  const std::string text =
      "[cam_0]\nname = \"0\"\nsize = [ 64, 80,]\nmatrix = [[60.0, 0.0, 32.0], [0.0, 60.0, 40.0], "
      "[0.0, 0.0, 1.0]]\ndistortions = [0.0, 0.0, 0.0, 0.0, 0.0]\nrotation = [0.0, 0.0, 0.0]\n"
      "translation = [0.0, 0.0, 1500.0]\n[metadata]\nadjusted = false\nerror = 0.0\n";
  write_file_atomically(folder / "session_1_camera_calibration.toml", text);
  fs::create_directories(folder / "synchronized_videos" / "Camera_000_synchronized");
  write_image(folder / "synchronized_videos" / "Camera_000_synchronized" / "000000.png",
              ByteImage(64, 80, 3));
  const Dataset dataset = open_dataset(folder.path());
  EXPECT_EQ(dataset.layout, "anipose");
  EXPECT_EQ(dataset.world_convention.metres_per_unit, 0.001);
  EXPECT_NEAR(dataset.cameras[0].camera_from_world_translation.z(), 1.5, 1e-12);
  EXPECT_EQ(dataset.frames[0].images.size(), 1U);
}

TEST(Masks, AnotherSizeOfTheSameShape_IsScaled) {
  fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  const fs::path written =
      write_layout(folder / "capture", "mvhumannet", folder / "mvh").folders.front();
  const Dataset before = open_dataset(written);
  const int frame = before.frames[0].masks.begin()->first;
  ByteImage large(128, 160, 1);
  for (int y = 20; y < 40; ++y) {
    for (int x = 10; x < 30; ++x) {
      large.at(x, y) = 255;
    }
  }
  const fs::path mask = before.frames[0].masks.begin()->second.file;
  fs::remove(mask);
  write_image(mask, large);
  FrameReader reader(open_dataset(written));
  const auto read = reader.mask(0, frame);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->width, 64);
  EXPECT_EQ(read->height, 80);
  EXPECT_EQ(read->at(5, 10), 255);
  EXPECT_EQ(read->at(14, 19), 255);
  EXPECT_EQ(read->at(4, 10), 0);
  EXPECT_EQ(read->at(15, 19), 0);
  EXPECT_EQ(reader.mask_header(0, frame)->width, 128);
  EXPECT_NE(finding_of(validate(reader).findings, "mask-scaled"), nullptr);
}

}  // namespace
}  // namespace atelier
