// A native capture in other layouts: what they store projects points to the same pixels.

#include "capture/layout.h"

#include <Eigen/Geometry>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include <gtest/gtest.h>

#include "capture/cameras_file.h"
#include "capture/capture_info.h"
#include "capture/dome.h"
#include "capture/truth_archive.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

const Eigen::Vector3d kPoint(0.2, 1.3, -0.1);

class Layout : public ::testing::Test {
 protected:
  void SetUp() override {
    cameras_ =
        dome_cameras({.cameras = 2, .pairs = false, .width = 64, .height = 80, .gain = 0}, {1, 1});
    CaptureInfo info;
    info.sequences = {{"clothed", "clothed", 12, {3, 4}}};
    for (const Camera& camera : cameras_) {
      for (const int frame : {3, 4}) {
        const std::string name = frame_name(frame);
        for (const char* part : {"images", "labels", "keypoints2d"}) {
          make_private_directory(capture() / part / camera.id);
        }
        write_image(capture() / "images" / camera.id / (name + ".png"),
                    ByteImage(64, 80, 3, static_cast<std::uint8_t>(frame)));
        ByteImage labels(64, 80, 1);
        labels.at(5, 6) = 3;
        write_labels(capture() / "labels" / camera.id / (name + ".png"), labels);
        write_file_atomically(capture() / "keypoints2d" / camera.id / (name + ".json"),
                              R"({"people":[{"pose_keypoints_2d":[10.5,20.5,0.9,0,0,0]}]})");
      }
    }
    write_file_atomically(capture() / "cameras.json", cameras_json(cameras_));
    write_file_atomically(capture() / "capture.toml", capture_toml(info));
  }

  fs::path capture() const { return folder_ / "capture"; }
  fs::path out() const { return folder_ / "out"; }
  std::string text(const fs::path& path) const {
    return read_file_text(out() / "clothed" / path, 1 << 20);
  }
  nlohmann::json json(const fs::path& path) const { return parse_json(text(path)); }

  testing::TemporaryDirectory folder_;
  std::vector<Camera> cameras_;
};

TEST_F(Layout, ColmapProjectsToTheSamePixel) {
  write_layout(capture(), "colmap", out());
  std::istringstream cameras(text("sparse/0/cameras.txt"));
  std::istringstream images(text("sparse/0/images.txt"));
  std::string line;
  std::vector<Camera> read;
  while (std::getline(cameras, line)) {
    if (line.front() == '#') {
      continue;
    }
    std::istringstream words(line);
    int id = 0;
    std::string model;
    Camera camera;
    camera.distortion_model = Distortion::Brown;
    words >> id >> model >> camera.width >> camera.height >> camera.fx >> camera.fy >> camera.cx >>
        camera.cy >> camera.distortion[0] >> camera.distortion[1] >> camera.distortion[2] >>
        camera.distortion[3];
    EXPECT_EQ(model, "OPENCV");
    read.push_back(camera);
  }
  ASSERT_EQ(read.size(), 2U);
  int count = 0;
  while (std::getline(images, line)) {
    if (line.empty() || line.front() == '#') {
      continue;
    }
    std::istringstream words(line);
    int id = 0;
    int camera_id = 0;
    Eigen::Quaterniond q;
    Eigen::Vector3d t;
    std::string name;
    words >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >> camera_id >> name;
    Camera camera = read[static_cast<std::size_t>(camera_id - 1)];
    camera.camera_from_world_rotation = q.toRotationMatrix();
    camera.camera_from_world_translation = t;
    const auto expected = project(cameras_[static_cast<std::size_t>(camera_id - 1)], kPoint);
    EXPECT_LT((*project(camera, kPoint) - *expected).norm(), 1e-9);
    EXPECT_TRUE(fs::exists(out() / "clothed" / "images" / name));
    EXPECT_TRUE(fs::exists(out() / "clothed" / "masks" / (name + ".png")));
    ++count;
  }
  EXPECT_EQ(count, 4);
}

TEST_F(Layout, PanopticIsInCentimetresWithPixelCentresAtZero) {
  write_layout(capture(), "panoptic", out());
  const nlohmann::json root = json("calibration_clothed.json");
  for (std::size_t c = 0; c < 2; ++c) {
    const nlohmann::json& entry = root["cameras"][c];
    Eigen::Vector3d x;
    for (std::size_t i = 0; i < 3; ++i) {
      x[static_cast<Index>(i)] = entry["t"][i][0].get<double>();
      for (std::size_t j = 0; j < 3; ++j) {
        x[static_cast<Index>(i)] +=
            entry["R"][i][j].get<double>() * 100 * kPoint[static_cast<Index>(j)];
      }
    }
    EXPECT_LT((x / 100 - camera_from_world(cameras_[c], kPoint)).norm(), 1e-12);
    EXPECT_DOUBLE_EQ(entry["K"][0][2].get<double>(), cameras_[c].cx - 0.5);
    EXPECT_EQ(entry["distCoef"].size(), 5U);
  }
}

TEST_F(Layout, NerfstudioIsZUpAndLooksBackwards) {
  write_layout(capture(), "nerfstudio", out());
  const nlohmann::json root = json("transforms.json");
  EXPECT_EQ(root["frames"].size(), 4U);
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

TEST_F(Layout, EasyMocapShiftsPixelsAndCountsFromZero) {
  const LayoutReport report = write_layout(capture(), "easymocap", out());
  EXPECT_FALSE(report.lost.empty());
  EXPECT_TRUE(fs::exists(out() / "clothed/images/00/000000.png"));
  const nlohmann::json annotation = json("annots/00/000001.json");
  EXPECT_EQ(annotation["annots"][0]["keypoints"][0][0], 10.0);
  EXPECT_EQ(annotation["annots"][0]["keypoints"][1][2], 0.0);
  EXPECT_NE(text("extri.yml").find("Rot_00"), std::string::npos);
  EXPECT_EQ(text("intri.yml").rfind("%YAML:1.0", 0), 0U);
  const ByteImage mask = read_labels(out() / "clothed/mask/00/000000.png");
  EXPECT_EQ(mask.at(5, 6), 255);
  EXPECT_EQ(mask.at(0, 0), 0);
}

TEST_F(Layout, ActorsHqStoresSharesOfTheSize) {
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
  const Eigen::Vector3d r(values[2], values[3], values[4]);
  const Eigen::Matrix3d world_from_camera =
      Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
  EXPECT_LT((world_from_camera.transpose() - cameras_[0].camera_from_world_rotation).norm(), 1e-12);
  EXPECT_NEAR(values[8] * 64, cameras_[0].fx, 1e-12);
  EXPECT_TRUE(fs::exists(out() / "clothed/1x/rgbs/Cam001/Cam001_rgb000003.png"));
}

TEST_F(Layout, DnaHoldsEncodedImagesAndWorldFromCamera) {
  write_layout(capture(), "dna", out());
  const Archive images = read_archive(out() / "clothed/main/clothed.smc", "dna.main", 1);
  const Tensor& first = images.datasets.at("Camera_5mp/0/color/0");
  const ByteImage image =
      read_byte_image(std::span<const std::byte>(first.data.data(), first.data.size()), "first");
  EXPECT_EQ(image.at(0, 0, 0), 3);
  const Archive annotations =
      read_archive(out() / "clothed/annotations/clothed_annots.smc", "dna.annotations", 1);
  const RowMatrix rt = matrix_of(annotations.datasets.at("Camera_Parameter/01/RT"), 4);
  EXPECT_LT((rt.block<3, 1>(0, 3) - camera_center(cameras_[1])).norm(), 1e-12);
}

TEST_F(Layout, RefusesUnfinishedCapturesAndFoldersThatAreThere) {
  write_layout(capture(), "colmap", out());
  ATELIER_EXPECT_REFUSED(write_layout(capture(), "colmap", out()), EnvironmentError,
                         "there already");
  ATELIER_EXPECT_REFUSED(write_layout(capture(), "mine", folder_ / "x"), LogicError, "no layout");
  fs::remove(capture() / "capture.toml");
  ATELIER_EXPECT_REFUSED(write_layout(capture(), "colmap", folder_ / "y"), DataError,
                         "finished native capture");
}

}  // namespace
}  // namespace atelier
