// The stage `ceiling`, which is `appearance` on true garments, on a capture made by hand: a cloth
// that waves over a ball, seen by three small cameras.
#if defined(ATELIER_HAS_CAPTURE)

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/cameras_file.h"
#include "capture/capture_info.h"
#include "capture/truth_archive.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/io/image_file.h"
#include "core/raster.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kSide = 56;
constexpr int kFrames = 4;  // the last one is held out, and so is the last camera
constexpr int kCameras = 3;

fs::path network_program() {
  return fs::path(program_path()).parent_path() / "atelier-appearance";
}

std::string bytes_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

std::string digits(int frame) {
  char text[16];
  std::snprintf(text, sizeof text, "%06d", frame);
  return text;
}

Camera camera_of(int i) {
  Camera camera;
  camera.id = "0" + std::to_string(i);
  camera.width = camera.height = kSide;
  camera.fx = camera.fy = 1.3 * kSide;
  camera.cx = camera.cy = kSide / 2.0;
  // Above the cloth, looking down, shifted and turned a little.
  const double lean = 0.15 * (i - 1);
  Eigen::Matrix3d down;
  down << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitY()).toRotationMatrix();
  camera.camera_from_world_rotation = turn * down;
  camera.camera_from_world_translation =
      Eigen::Vector3d(0, 0, 2) - camera.camera_from_world_rotation * Eigen::Vector3d(0.5, 1, 0.5);
  return camera;
}

Points cloth_at(const Mesh& cloth, int frame) {
  Points vertices = cloth.vertices;
  for (Index v = 0; v < vertices.rows(); ++v) {
    vertices(v, 1) = 1 + 0.06 * std::sin(7 * vertices(v, 0) + 1.3 * frame);
  }
  return vertices;
}

/// A picture as a light from the left would make it of a checked cloth, and its labels.
void take_picture(const fs::path& capture, const Mesh& cloth, const Camera& camera, int frame) {
  const Points vertices = cloth_at(cloth, frame);
  const Raster raster = rasterize(vertices, cloth.faces, camera);
  ByteImage picture(kSide, kSide, 3, 200);
  ByteImage labels(kSide, kSide, 1, 0);
  for (std::size_t i = 0; i < raster.face.data.size(); ++i) {
    const int f = raster.face.data[i];
    if (f < 0) {
      continue;
    }
    labels.data[i] = static_cast<std::uint8_t>(Label::Dress);
    const Eigen::Vector3d a = vertices.row(cloth.faces(f, 0));
    const Eigen::Vector3d b = vertices.row(cloth.faces(f, 1));
    const Eigen::Vector3d c = vertices.row(cloth.faces(f, 2));
    const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      const double print = 0.5 + 0.3 * std::sin(9 * a.x() + static_cast<double>(k));
      picture.data[3 * i + k] =
          static_cast<std::uint8_t>(255 * std::clamp(print * (0.7 - 0.6 * normal.x()), 0.0, 1.0));
    }
  }
  for (const char* kind : {"images", "truth/images"}) {
    write_image(capture / kind / camera.id / (digits(frame) + ".png"), picture);
  }
  write_labels(capture / "labels" / camera.id / (digits(frame) + ".png"), labels);
}

void make_capture(const fs::path& capture) {
  CaptureTruth truth;
  truth.skeleton.names = {"pelvis"};
  truth.skeleton.parents = {-1};
  truth.skeleton.offsets = Points::Zero(1, 3);
  truth.body = sphere(1);
  truth.body.vertices *= 0.2;
  truth.shape_names = {"stature"};
  truth.shape = Eigen::VectorXd::Constant(1, 1.7);
  truth.keypoint_names = {"nose"};
  TruthGarment garment;
  garment.garment.name = "cloth";
  Mesh& cloth = garment.garment.mesh;
  cloth = grid(8, 8);
  cloth.uvs.resize(cloth.vertices.rows(), 2);
  cloth.uvs.col(0) = cloth.vertices.col(0);
  cloth.uvs.col(1) = 1 - cloth.vertices.col(2).array();
  cloth.uv_faces = cloth.faces;
  garment.label = Label::Dress;
  truth.garments = {garment};
  truth.lights = {AreaLight{}};
  truth.numbers = {{"seed", 7}};
  CaptureInfo info;
  info.subject = "nobody";
  info.synthetic = true;
  info.consent = {{"nobody", "tests", ""}};
  CaptureSequence sequence{"clothed", "clothed", 12, {}};
  for (int c = 0; c < kCameras; ++c) {
    truth.cameras.push_back(camera_of(c));
    for (const char* kind : {"images", "truth/images", "labels"}) {
      fs::create_directories(capture / kind / truth.cameras.back().id);
    }
  }
  fs::create_directories(capture / "truth" / "frames");
  for (int f = 0; f < kFrames; ++f) {
    sequence.frame_ids.push_back(f);
    for (const Camera& camera : truth.cameras) {
      take_picture(capture, cloth, camera, f);
    }
    TruthFrame frame;
    frame.frame_id = f;
    frame.joints = Points::Zero(1, 3);
    frame.keypoints = Points::Zero(1, 3);
    frame.pose.rotations = Points::Zero(1, 3);
    frame.body = truth.body.vertices;
    frame.garments = {cloth_at(cloth, f)};
    write_archive(capture / "truth" / "frames" / (digits(f) + ".h5"), archive_of(frame, truth));
  }
  info.sequences = {sequence};
  info.held_out_cameras = {truth.cameras.back().id};
  info.held_out_frames = {kFrames - 1};
  write_archive(capture / "truth" / "truth.h5", archive_of(truth));
  write_file_atomically(capture / "cameras.json", cameras_json(truth.cameras));
  write_file_atomically(capture / "capture.toml", capture_toml(info));
}

const std::vector<std::string> kSmall = {"--resolution",       "32", "--channels",         "2",
                                         "--iterations",       "24", "--learning-rate",    "0.01",
                                         "--occlusion.strata", "3",  "--checkpoint-every", "4"};

class Appearance : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(network_program())) {
      GTEST_SKIP() << "built without libtorch";
    }
    make_capture(capture_);
  }
  ChildResult ceiling(const std::string& workspace, std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {program_path(), "ceiling", capture_.string(),
                                      (folder_ / workspace).string()};
    more = fixtures::with_usual(kSmall, more);
    words.insert(words.end(), more.begin(), more.end());
    return run_child(words);
  }
  fs::path result(const std::string& workspace, const char* file) const {
    return folder_ / workspace / "ceiling" / "current" / "cloth" / file;
  }
  std::vector<std::string> train(const std::string& model, const std::string& checkpoint,
                                 const std::string& channels = "2") const {
    return {network_program().string(),
            "train",
            result("ws", "data.h5").string(),
            (folder_ / model).string(),
            "--resolution",
            "32",
            "--channels",
            channels,
            "--iterations",
            "60",
            "--checkpoint_every",
            "5",
            "--checkpoint",
            (folder_ / checkpoint).string()};
  }

  TemporaryDirectory folder_;
  fs::path capture_ = folder_ / "capture";
};

TEST_F(Appearance, LearnsWithoutWhatIsHeldOutAndIsMeasuredOnIt) {
  const ChildResult done = ceiling("ws");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const ChildResult figures = run_child({program_path(), "evaluate", (folder_ / "ws").string(),
                                         "--truth", capture_.string(), "--stage", "appearance"});
  ASSERT_THAT(figures.exit_code, ::testing::AnyOf(0, 1)) << figures.err;
  for (const char* key : {"ceiling.psnr_db", "ceiling.gain_db", "ceiling.shadow_psnr_db",
                          "ceiling.ssim", "ceiling.covered"}) {
    EXPECT_THAT(figures.out, HasSubstr(key));
  }
  EXPECT_THAT(figures.out, HasSubstr("; small: 32 texels, 24 steps"));
  // Without the pictures that are held out: the same network, bit for bit.
  for (int c = 0; c < kCameras; ++c) {
    for (int f = 0; f < kFrames; ++f) {
      if (c == kCameras - 1 || f == kFrames - 1) {
        fs::remove(capture_ / "images" / ("0" + std::to_string(c)) / (digits(f) + ".png"));
        fs::remove(capture_ / "labels" / ("0" + std::to_string(c)) / (digits(f) + ".png"));
      }
    }
  }
  fs::remove_all(capture_ / "truth" / "images");
  const ChildResult again = ceiling("without");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(bytes_of(result("without", "model.safetensors")),
            bytes_of(result("ws", "model.safetensors")));
}

TEST_F(Appearance, GoesOnAfterAKillToTheSameBits) {
  ASSERT_EQ(ceiling("ws").exit_code, 0);
  ASSERT_EQ(run_child(train("whole.safetensors", "whole.checkpoint")).exit_code, 0);
  {
    const ChildProcess half(train("half.safetensors", "half.checkpoint"));
    while (!fs::exists(folder_ / "half.checkpoint") && !half.has_ended()) {
      std::this_thread::yield();
    }
    half.kill(SIGKILL);
  }
  ASSERT_TRUE(fs::exists(folder_ / "half.checkpoint"));
  ASSERT_EQ(run_child(train("half.safetensors", "half.checkpoint")).exit_code, 0);
  EXPECT_EQ(bytes_of(folder_ / "half.safetensors"), bytes_of(folder_ / "whole.safetensors"));
  // Of another architecture, cut off, and no checkpoint at all.
  ChildResult refused = run_child(train("x.safetensors", "whole.checkpoint", "3"));
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("channels"));
  fs::resize_file(folder_ / "half.checkpoint", fs::file_size(folder_ / "half.checkpoint") - 9);
  refused = run_child(train("x.safetensors", "half.checkpoint"));
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("half.checkpoint"));
  EXPECT_FALSE(fs::exists(folder_ / "x.safetensors"));
}

TEST_F(Appearance, PicturesThatContradictTheGeometryAreRefused) {
  const fs::path labels = capture_ / "labels";
  for (const auto& entry : fs::recursive_directory_iterator(labels)) {
    if (entry.is_regular_file()) {
      write_labels(entry.path(), ByteImage(kSide, kSide, 1, 1));
    }
  }
  const ChildResult refused = ceiling("ws");
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("of one capture"));
}

TEST_F(Appearance, AWorkspaceWithoutNetworksCannotDraw) {
  fs::create_directories(folder_ / "empty");
  const ChildResult refused = run_child(
      {program_path(), "draw", (folder_ / "empty").string(), "--out", (folder_ / "out").string()});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("run 'atelier appearance' first"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  const ChildResult nowhere = run_child({program_path(), "draw", (folder_ / "nowhere").string(),
                                         "--out", (folder_ / "out").string()});
  EXPECT_EQ(nowhere.exit_code, 3);
  EXPECT_THAT(nowhere.err, HasSubstr("nowhere: no folder; expected a workspace"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
