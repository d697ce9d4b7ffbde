// Every layout: what is written reads back to the same projections, images, masks and detections.

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core/persistence.hpp>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "capture/camera_conventions.h"
#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "tests/capture/small_capture.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// What a layout holds beside poses, focal lengths and pictures.
struct Holds {
  const char* layout;
  bool distortion = true;  ///< the five numbers
  bool masks = true;
  bool detections = false;
  bool ids = true;        ///< names of cameras
  bool frame_ids = true;  ///< else they begin at 0
  bool gain = false;
  bool fisheye = false;
  bool first_person = false;  ///< of the detections, only the first
};

std::ostream& operator<<(std::ostream& out, const Holds& holds) {
  return out << holds.layout;
}

const Holds kLayouts[] = {
    {.layout = "native", .detections = true, .gain = true, .fisheye = true},
    {.layout = "easymocap", .detections = true, .frame_ids = false},
    {.layout = "goliath", .masks = false},
    {.layout = "actorshq", .distortion = false, .ids = false},
    {.layout = "dna",
     .detections = true,
     .ids = false,
     .frame_ids = false,
     .gain = true,
     .first_person = true},
    {.layout = "mvhumannet", .detections = true},
    {.layout = "avatarrex"},
    {.layout = "panoptic", .masks = false, .ids = false},
    {.layout = "human36m", .masks = false},
    {.layout = "colmap", .fisheye = true},
    {.layout = "colmap_binary", .fisheye = true},
    {.layout = "nerfstudio", .fisheye = true},
    {.layout = "caliscope", .masks = false, .detections = true, .fisheye = true},
    {.layout = "pose2sim", .masks = false, .detections = true, .fisheye = true},
    {.layout = "qualisys", .masks = false, .detections = true},
    {.layout = "anipose", .masks = false, .detections = true, .fisheye = true},
    {.layout = "thuman4"},
};

/// Points all over the room, not on any axis.
std::vector<Eigen::Vector3d> room() {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 27; ++i) {
    points.emplace_back(0.4 * (i % 3 - 1) + 0.01, 0.9 + 0.5 * (i / 3 % 3 - 1),
                        0.3 * (i / 9 - 1) - 0.02);
  }
  return points;
}

double worst_projection(const Camera& a, const Camera& b) {
  double worst = 0;
  int seen = 0;
  for (const Eigen::Vector3d& point : room()) {
    const auto x = project(a, point);
    const auto y = project(b, point);
    EXPECT_EQ(x.has_value(), y.has_value());
    if (x && y) {
      worst = std::max(worst, (*x - *y).norm());
      ++seen;
    }
  }
  EXPECT_GT(seen, 10);
  return worst;
}

class EveryLayout : public ::testing::TestWithParam<Holds> {
 protected:
  /// The small capture in the layout and back.
  Dataset there_and_back(const fixtures::SmallCapture& capture) {
    fixtures::write_small_capture(folder_ / "capture", capture);
    const LayoutReport report =
        write_layout(folder_ / "capture", GetParam().layout, folder_ / "out");
    EXPECT_EQ(report.folders.size(), 1U);
    report_ = report;
    DatasetOptions options;
    options.metres_per_unit = unit_;
    Dataset dataset = open_dataset(report.folders.front(), options);
    EXPECT_EQ(dataset.layout, GetParam().layout);
    EXPECT_FALSE(dataset.evidence.empty());
    return dataset;
  }

  fixtures::TemporaryDirectory folder_;
  LayoutReport report_;
  double unit_ = 0;
};

INSTANTIATE_TEST_SUITE_P(Layouts, EveryLayout, ::testing::ValuesIn(kLayouts),
                         [](const auto& layout) { return std::string(layout.param.layout); });

TEST_P(EveryLayout, ConvertedCapture_KeepsProjectionsImagesAndDetections) {
  fixtures::SmallCapture capture;
  for (Camera& camera : capture.cameras) {
    if (GetParam().distortion) {
      camera.distortion_model = Distortion::Brown;
      camera.distortion = {-0.2, 0.05, 0.001, -0.002, 0.003};
    } else {
      camera.distortion_model = Distortion::None;
      camera.distortion = {};
    }
    if (GetParam().gain) {
      camera.gain = {1.25, 1, 0.8};
    }
  }
  const Dataset dataset = there_and_back(capture);
  ASSERT_EQ(dataset.cameras.size(), 3U);
  EXPECT_FALSE(has_errors(dataset.findings));
  FrameReader reader(dataset);
  for (std::size_t c = 0; c < 3; ++c) {
    const Camera& expected = capture.cameras[c];
    const Camera& camera = dataset.cameras[c];
    SCOPED_TRACE(camera.id);
    if (GetParam().ids) {
      EXPECT_EQ(camera.id, expected.id);
    }
    EXPECT_EQ(camera.width, expected.width);
    EXPECT_EQ(camera.height, expected.height);
    EXPECT_LT(worst_projection(expected, camera), 1e-9);
    if (GetParam().gain) {
      EXPECT_LT((camera.gain - expected.gain).norm(), 1e-12);
    }
    for (const int frame : {3, 4}) {
      const int id = GetParam().frame_ids ? frame : frame - 3;
      const auto index = static_cast<Index>(c);
      const std::optional<ByteImage> picture = reader.byte_image(index, id);
      ASSERT_TRUE(picture.has_value());
      EXPECT_EQ(picture->at(7, 9, 0), 100 + static_cast<int>(c));
      EXPECT_EQ(picture->at(7, 9, 1), frame);
      const std::optional<ByteImage> mask = reader.mask(index, id);
      ASSERT_EQ(mask.has_value(), GetParam().masks);
      if (mask) {
        EXPECT_EQ(mask->at(5, 6), 255);
        EXPECT_EQ(mask->at(6, 5), 0);
      }
      const std::vector<PersonKeypoints> people = reader.keypoints(index, id);
      const std::vector<PersonKeypoints> expected_people = fixtures::small_people(frame);
      ASSERT_EQ(people.size(), !GetParam().detections ? 0U : GetParam().first_person ? 1U : 2U);
      for (std::size_t i = 0; i < people.size(); ++i) {
        EXPECT_LT((people[i].points - expected_people[i].points).cwiseAbs().maxCoeff(), 1e-9);
      }
    }
  }
  EXPECT_EQ(frame_ids(dataset).size(), 2U);
}

TEST_P(EveryLayout, FisheyeLens_IsKeptOrReportedLost) {
  fixtures::SmallCapture capture;
  for (Camera& camera : capture.cameras) {
    camera.distortion_model = Distortion::Fisheye;
    camera.distortion = {0.02, -0.003, 0.001, 0.0005};
  }
  const Dataset dataset = there_and_back(capture);
  bool said = false;
  for (const std::string& sentence : report_.lost) {
    said = said || (sentence.find("fisheye lens of") != std::string::npos &&
                    sentence.find(" px") != std::string::npos);
  }
  EXPECT_EQ(said, !GetParam().fisheye);
  for (std::size_t c = 0; c < 3; ++c) {
    const double worst = worst_projection(capture.cameras[c], dataset.cameras[c]);
    EXPECT_EQ(worst < 1e-9, GetParam().fisheye) << worst;
  }
}

TEST_P(EveryLayout, ColorGain_IsKeptOrReportedLost) {
  fixtures::SmallCapture capture;
  capture.cameras[1].gain = {1.1, 1, 0.9};
  there_and_back(capture);
  bool said = false;
  for (const std::string& sentence : report_.lost) {
    said = said || sentence.find("gains") != std::string::npos;
  }
  EXPECT_EQ(said, !GetParam().gain);
}

TEST_P(EveryLayout, JpegBytes_AreCopiedUnchanged) {
  fixtures::SmallCapture capture;
  capture.extension = ".jpg";
  const Dataset dataset = there_and_back(capture);
  FrameReader reader(dataset);
  const fs::path source =
      folder_ / "capture" / "images" / capture.cameras[0].id / (frame_name(3) + ".jpg");
  const auto image = reader.encoded_image(0, GetParam().frame_ids ? 3 : 0);
  ASSERT_TRUE(image.has_value());
  EXPECT_EQ(image->bytes, read_file_bytes(source, 1 << 20));
  EXPECT_EQ(image->extension, ".jpg");
}

TEST_P(EveryLayout, FolderWithoutItsFiles_IsRefused) {
  fs::create_directory(folder_ / "empty");
  DatasetOptions options;
  options.layout = GetParam().layout;
  EXPECT_THROW(open_dataset(folder_ / "empty", options), DataError);
}

TEST_P(EveryLayout, TruncatedCalibration_IsRefused) {
  fixtures::write_small_capture(folder_ / "capture");
  const fs::path out =
      write_layout(folder_ / "capture", GetParam().layout, folder_ / "out").folders.front();
  // The largest file that is no image: the calibration.
  fs::path calibration;
  std::uintmax_t most = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(out)) {
    const std::string extension = entry.path().extension().string();
    const std::string path = entry.path().string();
    if (entry.is_regular_file() && extension != ".png" && extension != ".zip" &&
        path.find("annots/") == std::string::npos && path.find("pose") == std::string::npos &&
        path.find("keypoints2d") == std::string::npos && entry.file_size() >= most) {
      most = entry.file_size();
      calibration = entry.path();
    }
  }
  ASSERT_FALSE(calibration.empty());
  fs::resize_file(calibration, most / 2);
  DatasetOptions options;
  options.layout = GetParam().layout;
  EXPECT_THROW(open_dataset(out, options), DataError) << calibration;
}

class Layout : public ::testing::Test {
 protected:
  void SetUp() override {
    fixtures::write_small_capture(capture(), small_);
    cameras_ = small_.cameras;
  }

  fs::path capture() const { return folder_ / "capture"; }
  fs::path out() const { return folder_ / "out"; }
  std::string text(const fs::path& path) const {
    return read_file_text(out() / "clothed" / path, 1 << 20);
  }
  nlohmann::json json(const fs::path& path) const { return parse_json(text(path)); }

  fixtures::TemporaryDirectory folder_;
  fixtures::SmallCapture small_;
  std::vector<Camera> cameras_;
};

const Eigen::Vector3d kPoint(0.2, 1.3, -0.1);

TEST_F(Layout, Panoptic_IsInCentimetresYDown) {
  write_layout(capture(), "panoptic", out());
  const nlohmann::json root = json("calibration_clothed.json");
  const Eigen::Vector3d theirs = 100 * Eigen::Vector3d(kPoint.x(), -kPoint.y(), -kPoint.z());
  for (std::size_t c = 0; c < 2; ++c) {
    const nlohmann::json& entry = root["cameras"][c];
    Eigen::Vector3d x;
    for (std::size_t i = 0; i < 3; ++i) {
      x[static_cast<Index>(i)] = entry["t"][i][0].get<double>();
      for (std::size_t j = 0; j < 3; ++j) {
        x[static_cast<Index>(i)] += entry["R"][i][j].get<double>() * theirs[static_cast<Index>(j)];
      }
    }
    EXPECT_LT((x / 100 - camera_from_world(cameras_[c], kPoint)).norm(), 1e-12);
    EXPECT_DOUBLE_EQ(entry["K"][0][2].get<double>(), cameras_[c].cx - 0.5);
    EXPECT_EQ(entry["distCoef"].size(), 5U);
  }
}

TEST(LensLeftOut, EquidistantFisheye_SaysHowFarItsCornersAreOff) {
  Camera camera;
  camera.id = "cam3";
  camera.width = camera.height = 1000;
  camera.fx = camera.fy = 1000;
  camera.cx = camera.cy = 500;
  camera.distortion_model = Distortion::Fisheye;
  // A corner is 707.1 px from the centre, 0.7071 rad; a pinhole has it at 1000 tan(0.7071) = 854.5.
  EXPECT_NE(lens_left_out(camera).find("the fisheye lens of cam3 is left out, off by up to 147 px"),
            std::string::npos)
      << lens_left_out(camera);
}

TEST(NerfstudioLens, LensOfAllCameras_StandsAtTheTopOfTheFile) {
  const auto written = [](int fisheyes, LayoutReport& report) {
    const fixtures::TemporaryDirectory folder;
    fixtures::SmallCapture capture;
    for (int c = 0; c < fisheyes; ++c) {
      capture.cameras[static_cast<std::size_t>(c)].distortion_model = Distortion::Fisheye;
    }
    fixtures::write_small_capture(folder / "capture", capture);
    report = write_layout(folder / "capture", "nerfstudio", folder / "out");
    return nlohmann::json::parse(
        read_file_text(report.folders.front() / "transforms.json", 1 << 20))["camera_model"];
  };
  LayoutReport report;
  EXPECT_EQ(written(0, report), "OPENCV");
  EXPECT_EQ(written(3, report), "OPENCV_FISHEYE");
  const std::size_t lost = report.lost.size();
  EXPECT_EQ(written(1, report), "OPENCV_FISHEYE");
  EXPECT_EQ(report.lost.size(), lost + 1) << "lenses of two kinds in one file";
}

TEST_F(Layout, Nerfstudio_IsZUpAndLooksBackwards) {
  write_layout(capture(), "nerfstudio", out());
  const nlohmann::json root = json("transforms.json");
  EXPECT_EQ(root["frames"].size(), 6U);
  const nlohmann::json& entry = root["frames"][0];
  const auto at = [&](std::size_t i, std::size_t j) {
    return entry["transform_matrix"][i][j].get<double>();
  };
  const Eigen::Vector3d center = camera_center(cameras_[0]);
  EXPECT_NEAR(at(0, 3), center.x(), 1e-12);
  EXPECT_NEAR(at(1, 3), -center.z(), 1e-12);
  EXPECT_NEAR(at(2, 3), center.y(), 1e-12);
  // The camera looks along its -z, to the subject: from the outside inwards.
  EXPECT_GT(at(0, 2) * at(0, 3) + at(1, 2) * at(1, 3), 0);
  EXPECT_DOUBLE_EQ(root["frames"][1]["time"].get<double>(), 1.0 / 12);
}

TEST_F(Layout, EasyMocap_ShiftsPixelsAndIsZUp) {
  const LayoutReport report = write_layout(capture(), "easymocap", out());
  EXPECT_FALSE(report.lost.empty());
  EXPECT_TRUE(fs::exists(out() / "clothed/images" / cameras_[0].id / "000000.png"));
  const nlohmann::json annotation = json("annots/" + cameras_[0].id + "/000001.json");
  EXPECT_EQ(annotation["annots"][0]["keypoints"][0][0], 10.25 + 4 - 0.5);
  EXPECT_EQ(annotation["annots"][0]["keypoints"][24][2], 0.0);
  EXPECT_EQ(annotation["annots"].size(), 2U);
  EXPECT_NE(text("extri.yml").find("Rot_" + cameras_[0].id), std::string::npos);
  EXPECT_EQ(text("intri.yml").rfind("%YAML:1.0", 0), 0U);
  DatasetOptions untouched;
  untouched.up = "y";
  const Dataset z_up = open_dataset(report.folders.front(), untouched);
  const Eigen::Vector3d center = camera_center(cameras_[0]);
  EXPECT_LT((camera_center(z_up.cameras[0]) - Eigen::Vector3d(center.x(), -center.z(), center.y()))
                .norm(),
            1e-12);
}

/// OpenCV refuses keys that begin with a digit, which names of cameras do.
TEST_F(Layout, EasyMocapOfCamerasThatAreNumbers_IsReadByOpenCv) {
  fixtures::SmallCapture numbered;
  const std::array names = {"400002", "03", "7"};
  for (std::size_t c = 0; c < names.size(); ++c) {
    numbered.cameras[c].id = names[c];
  }
  fixtures::write_small_capture(folder_ / "numbered", numbered);
  const fs::path folder =
      write_layout(folder_ / "numbered", "easymocap", folder_ / "theirs").folders.front();
  cv::FileStorage intrinsics((folder / "intri.yml").string(), cv::FileStorage::READ);
  cv::FileStorage extrinsics((folder / "extri.yml").string(), cv::FileStorage::READ);
  ASSERT_TRUE(intrinsics.isOpened() && extrinsics.isOpened());
  ASSERT_EQ(intrinsics["names"].size(), names.size());
  for (const Camera& camera : numbered.cameras) {
    const cv::Mat matrix = intrinsics["K_" + camera.id].mat();
    ASSERT_EQ(matrix.size(), cv::Size(3, 3)) << camera.id;
    EXPECT_EQ(matrix.at<double>(0, 0), camera.fx);
    EXPECT_EQ(matrix.at<double>(0, 2), camera.cx - 0.5);
    EXPECT_EQ(extrinsics["T_" + camera.id].mat().total(), 3U) << camera.id;
  }
}

TEST_F(Layout, ActorsHq_StoresRelativeIntrinsicsAndCameraToWorld) {
  write_layout(capture(), "actorshq", out());
  std::istringstream csv(text("1x/calibration.csv"));
  std::string header;
  std::string line;
  std::getline(csv, header);
  EXPECT_EQ(header, "name,w,h,rx,ry,rz,tx,ty,tz,fx,fy,px,py");
  std::getline(csv, line);
  std::vector<double> values;
  std::istringstream words(line.substr(line.find(',') + 1));
  for (std::string word; std::getline(words, word, ',');) {
    values.push_back(std::stod(word));
  }
  ASSERT_EQ(values.size(), 12U);
  EXPECT_LT((Eigen::Vector3d(values[5], values[6], values[7]) - camera_center(cameras_[0])).norm(),
            1e-12);
  EXPECT_NEAR(values[8] * 64, cameras_[0].fx, 1e-12);
  EXPECT_TRUE(fs::exists(out() / "clothed/1x/rgbs/Cam001/Cam001_rgb000003.png"));
}

TEST_F(Layout, Goliath_StoresTransposedMatricesInMillimetres) {
  write_layout(capture(), "goliath", out());
  const nlohmann::json entry = json("camera_calibration.json")["KRT"][0];
  EXPECT_EQ(entry["K"][0][2], 0.0);
  EXPECT_DOUBLE_EQ(entry["K"][2][0].get<double>(), cameras_[0].cx - 0.5);
  EXPECT_NEAR(entry["T"][3][2].get<double>(), 1000 * cameras_[0].camera_from_world_translation.z(),
              1e-9);
  EXPECT_TRUE(fs::exists(out() / "clothed/image" / ("cam" + cameras_[0].id + ".zip")));
}

TEST_F(Layout, ChainOfAllLayouts_KeepsProjections) {
  // One after the other through all that hold the lens: errors would add up.
  Dataset dataset = open_dataset(capture());
  int step = 0;
  for (const char* layout :
       {"easymocap", "colmap", "panoptic", "qualisys", "goliath", "nerfstudio", "dna", "caliscope",
        "mvhumannet", "pose2sim", "colmap_binary", "avatarrex", "anipose", "human36m", "native"}) {
    const fs::path out = folder_ / ("step" + std::to_string(step++));
    dataset = open_dataset(write_layout(dataset, layout, out).folders.front());
    EXPECT_EQ(dataset.layout, layout);
    ASSERT_EQ(dataset.cameras.size(), 3U) << layout;
  }
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_LT(worst_projection(cameras_[c], dataset.cameras[c]), 1e-9);
  }
}

TEST_F(Layout, UnfinishedCaptureOrExistingFolder_IsRefused) {
  write_layout(capture(), "colmap", out());
  ATELIER_EXPECT_REFUSED(write_layout(capture(), "colmap", out()), EnvironmentError,
                         "there already");
  ATELIER_EXPECT_REFUSED(write_layout(capture(), "mine", folder_ / "x"), LogicError, "no layout");
  fs::remove(capture() / "capture.toml");
  ATELIER_EXPECT_REFUSED(write_layout(capture(), "colmap", folder_ / "y"), DataError,
                         "finished native capture");
}

TEST_F(Layout, CalibrationOfUncalibratedCapture_IsRefused) {
  fs::remove(capture() / "capture.toml");
  fs::remove(capture() / "cameras.json");
  const Dataset dataset = open_dataset(capture());
  EXPECT_EQ(dataset.layout, "images");
  EXPECT_FALSE(dataset.calibrated);
  ATELIER_EXPECT_REFUSED(write_layout(dataset, "colmap", out()), DataError, "without calibration");
  EXPECT_EQ(write_layout(dataset, "images", out()).folders.size(), 1U);
}

}  // namespace
}  // namespace atelier
