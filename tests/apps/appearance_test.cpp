// The stage `ceiling`, which is `appearance` on true garments, on a capture made by hand: a cloth
// that waves over a ball, seen by ten small cameras; `appearance` and `draw` on what could be its
// registered garment and body.
#if defined(ATELIER_HAS_CAPTURE)

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "capture/cameras_file.h"
#include "capture/capture_info.h"
#include "capture/truth_archive.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/device.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/io/safetensors.h"
#include "core/raster.h"
#include "core/sequence_archive.h"
#include "core/store/run_stage.h"
#include "core/tensor.h"
#include "tests/apps/program_versions.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

constexpr int kSide = 56;
constexpr int kFrames = 4;  // the last one is held out, and so is the last camera
constexpr int kCameras = 10;

fs::path network_program() {
  return fs::path(program_path()).parent_path() / "atelier-appearance";
}

std::string bytes_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// Of a file of tensors: in the last element of the last one.
void flip_last_bit(const fs::path& path) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(-1, std::ios::end);
  const int last = file.get();
  file.seekp(-1, std::ios::end);
  file.put(static_cast<char>(last ^ 1));
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
  // Above the cloth, looking down, shifted a little, each turned another way.
  const double lean = 0.04 * (i - 4);
  Eigen::Matrix3d down;
  down << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(0.7 * i, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  camera.camera_from_world_rotation = turn * down;
  camera.camera_from_world_translation =
      Eigen::Vector3d(0, 0, 2) - camera.camera_from_world_rotation * Eigen::Vector3d(0.5, 1, 0.5);
  return camera;
}

Mesh waving_cloth() {
  Mesh cloth = grid(8, 8);
  cloth.uvs.resize(cloth.vertices.rows(), 2);
  cloth.uvs.col(0) = cloth.vertices.col(0);
  cloth.uvs.col(1) = 1 - cloth.vertices.col(2).array();
  cloth.uv_faces = cloth.faces;
  return cloth;
}

Points cloth_at(const Mesh& cloth, int frame) {
  Points vertices = cloth.vertices;
  for (Index v = 0; v < vertices.rows(); ++v) {
    vertices(v, 1) = 1 + 0.06 * std::sin(7 * vertices(v, 0) + 1.3 * frame);
  }
  return vertices;
}

/// A picture as a light from the left would make it of a checked cloth over a grey ball, and its
/// labels.
void take_picture(const fs::path& capture, const Mesh& cloth, const Mesh& ball,
                  const Camera& camera, int frame) {
  const Points vertices = cloth_at(cloth, frame);
  const Raster raster = rasterize(vertices, cloth.faces, camera);
  const Raster below = rasterize(ball.vertices, ball.faces, camera);
  ByteImage picture(kSide, kSide, 3, 200);
  ByteImage labels(kSide, kSide, 1, 0);
  for (std::size_t i = 0; i < below.face.data.size(); ++i) {
    if (below.face.data[i] >= 0) {
      labels.data[i] = static_cast<std::uint8_t>(Label::Skin);
      std::fill_n(picture.data.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                  static_cast<std::uint8_t>(120));
    }
  }
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

/// Half under the cloth.
Mesh ball() {
  Mesh mesh = sphere(2);
  mesh.uvs.resize(mesh.vertices.rows(), 2);
  mesh.uvs.col(0) = (0.5 + 0.4 * mesh.vertices.col(0).array()).matrix();
  mesh.uvs.col(1) = (0.5 + 0.4 * mesh.vertices.col(2).array()).matrix();
  mesh.uv_faces = mesh.faces;
  mesh.vertices *= 0.3;
  mesh.vertices.rowwise() += Eigen::RowVector3d(-0.15, 0.6, 0.5);
  return mesh;
}

void make_capture(const fs::path& capture) {
  CaptureTruth truth;
  truth.skeleton.names = {"pelvis"};
  truth.skeleton.parents = {-1};
  truth.skeleton.offsets = Points::Zero(1, 3);
  truth.body = ball();
  truth.shape_names = {"stature"};
  truth.shape = Eigen::VectorXd::Constant(1, 1.7);
  truth.keypoint_names = {"nose"};
  TruthGarment garment;
  garment.garment.name = "cloth";
  Mesh& cloth = garment.garment.mesh;
  cloth = waving_cloth();
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
      take_picture(capture, cloth, truth.body, camera, f);
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

struct NoChoice {};
OptionTable describe(NoChoice&) {
  return {};
}

/// The truth of the capture as if stages had found it.
void write_found(StageRun& run, const std::string& folder, const Mesh& mesh,
                 const std::function<Points(int)>& at) {
  SequenceHeader header;
  header.fps = 12;
  header.shared = mesh;
  header.shared.vertices.resize(0, 3);
  for (int f = 0; f < kFrames; ++f) {
    header.frame_ids.push_back(f);
  }
  run.output((fs::path(folder) / "sequence.h5").generic_string(),
             [&](const auto& file) { write_archive(file, archive_of(header)); });
  for (int f = 0; f < kFrames; ++f) {
    Mesh frame;
    frame.vertices = at(f);
    run.output(sequence_frame_path(folder, f).generic_string(),
               [&](const auto& file) { write_mesh_archive(file, frame); });
  }
}

constexpr std::array kFoundStages = {
    Stage{.name = "body",
          .summary = "the ball",
          .inputs = {"capture"},
          .outputs = {"bodies"},
          .options = option_set<NoChoice>,
          .run =
              [](StageRun& run) {
                write_found(run, "", ball(), [](int) { return ball().vertices; });
              }},
    Stage{.name = "register",
          .summary = "the cloth",
          .inputs = {"capture"},
          .outputs = {"registered"},
          .options = option_set<NoChoice>,
          .run =
              [](StageRun& run) {
                write_found(run, "registered/dress", waving_cloth(),
                            [](int f) { return cloth_at(waving_cloth(), f); });
              }},
};

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
  /// Nothing half done, and nothing that the next run would find.
  void expect_nothing_of_ceiling(const std::string& workspace) const {
    EXPECT_FALSE(fs::exists(folder_ / workspace / "ceiling")) << "nothing was made";
  }
  /// Moves pictures of a camera to another; labels go, without which nothing but the pictures says
  /// that they are of something else.
  void give_pictures(const std::vector<std::pair<int, int>>& from_to) const {
    fs::remove_all(capture_ / "labels");
    fs::rename(capture_ / "images", capture_ / "taken");
    fs::copy(capture_ / "taken", capture_ / "images", fs::copy_options::recursive);
    for (const auto& [from, to] : from_to) {
      const fs::path place = capture_ / "images" / ("0" + std::to_string(to));
      fs::remove_all(place);
      fs::copy(capture_ / "taken" / ("0" + std::to_string(from)), place,
               fs::copy_options::recursive);
    }
    fs::remove_all(capture_ / "taken");
  }
  /// A workspace in which `body` and `register` have found the truth.
  fs::path found() const {
    const std::vector<Stage> all = with_program_versions(kFoundStages);
    for (const Stage& stage : all) {
      StageRequest request;
      request.input = capture_;
      request.workspace = folder_ / "found";
      request.options = stage.options();
      run_stage(all, stage, request);
    }
    return folder_ / "found";
  }
  ChildResult appearance(const fs::path& workspace, std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {program_path(), "appearance", capture_.string(),
                                      workspace.string()};
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
            (folder_ / checkpoint).string(),
            "--log",
            (folder_ / (model + ".csv")).string()};
  }

  TemporaryDirectory folder_;
  fs::path capture_ = folder_ / "capture";
};

TEST_F(Appearance, LearnsWithoutWhatIsHeldOutAndIsMeasuredOnIt) {
  const ChildResult done = ceiling("ws");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, MatchesRegex("(.|\n)*ceiling  24/24 steps  [^\n]*/s  [^\n]* left  "
                                     "loss [0-9.e-]+  psnr_db [0-9.]+\n(.|\n)*"));
  const ChildResult figures = run_child({program_path(), "evaluate", (folder_ / "ws").string(),
                                         "--truth", capture_.string(), "--stage", "appearance"});
  ASSERT_THAT(figures.exit_code, ::testing::AnyOf(0, 1)) << figures.err;
  for (const char* key : {"ceiling.psnr_db", "ceiling.gain_db", "ceiling.shadow_psnr_db",
                          "ceiling.shadow_ssim", "ceiling.ssim", "ceiling.covered"}) {
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

TEST_F(Appearance, WhatRegistrationCostsIsTheCeilingLessWhatIsReached) {
  const fs::path workspace = found();
  ASSERT_EQ(appearance(workspace).exit_code, 0);
  const auto figures = [&] {
    const ChildResult result = run_child({program_path(), "evaluate", workspace.string(), "--truth",
                                          capture_.string(), "--stage", "appearance", "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out);
  };
  EXPECT_FALSE(figures().contains("appearance.below_ceiling_db")) << "there is no ceiling yet";
  ASSERT_EQ(ceiling("found").exit_code, 0);
  const nlohmann::json both = figures();
  const double ceiling_db = both.at("ceiling.psnr_db");
  const double reached_db = both.at("appearance.psnr_db");
  EXPECT_GT(ceiling_db, 10);
  EXPECT_GT(reached_db, 10);
  EXPECT_NEAR(both.at("appearance.below_ceiling_db"), ceiling_db - reached_db, 1e-9);
  EXPECT_NEAR(ceiling_db, reached_db, 1.5) << "what was found is the truth";
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
  std::ofstream(folder_ / "half.safetensors.csv", std::ios::app) << "5";  // of "57,...": torn
  ASSERT_EQ(run_child(train("half.safetensors", "half.checkpoint")).exit_code, 0);
  EXPECT_EQ(bytes_of(folder_ / "half.safetensors"), bytes_of(folder_ / "whole.safetensors"));
  EXPECT_EQ(bytes_of(folder_ / "half.safetensors.csv"),
            bytes_of(folder_ / "whole.safetensors.csv"));
  std::vector<std::string> diverging = train("diverged.safetensors", "diverged.checkpoint");
  diverging.insert(diverging.end(), {"--learning-rate", "1", "--iterations", "24"});
  const ChildResult diverged = run_child(diverging);
  EXPECT_EQ(diverged.exit_code, 4) << diverged.err;
  EXPECT_THAT(diverged.err, HasSubstr("below the"));
  EXPECT_FALSE(fs::exists(folder_ / "diverged.safetensors"));
  // Of another architecture, with a flipped bit, and cut off.
  ChildResult refused = run_child(train("x.safetensors", "whole.checkpoint", "3"));
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("channels"));
  flip_last_bit(folder_ / "half.checkpoint");
  refused = run_child(train("x.safetensors", "half.checkpoint"));
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("half.checkpoint"));
  EXPECT_THAT(refused.err, HasSubstr("damaged"));
  EXPECT_THAT(refused.err, HasSubstr("remove that file, or give --force"));
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

TEST_F(Appearance, CamerasWhosePicturesContradictAreNamedWithoutLabelsToo) {
  give_pictures({});
  ChildResult done = ceiling("ws");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, Not(HasSubstr("contradict")));
  give_pictures({{0, 3}, {3, 0}});
  done = ceiling("exchanged");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("pictures of camera 00 contradict the geometry"));
  EXPECT_THAT(done.err, HasSubstr("pictures of camera 03 contradict the geometry"));
  for (const char* right : {"01", "02", "04", "05", "06", "07", "08"}) {
    EXPECT_THAT(done.err, Not(HasSubstr(std::string("pictures of camera ") + right)));
  }
}

TEST_F(Appearance, PicturesOfWhichMostContradictAreRefusedWithoutLabelsToo) {
  give_pictures({{0, 8}, {1, 7}, {2, 6}, {3, 5}, {5, 3}, {6, 2}, {7, 1}, {8, 0}});
  const ChildResult refused = ceiling("ws");
  EXPECT_EQ(refused.exit_code, 3) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("of one capture"));
}

TEST_F(Appearance, ACameraWithoutPicturesIsNamed) {
  fs::remove_all(capture_ / "images" / "01");
  fs::remove(capture_ / "images" / "03" / "000000.png");
  const ChildResult done = ceiling("ws");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("camera 01 has no picture of 3 of 3 frames"));
  EXPECT_THAT(done.err, HasSubstr("camera 03 has no picture of 1 of 3 frames"));
  EXPECT_THAT(done.err, Not(HasSubstr("camera 09")));  // it is held out
}

TEST_F(Appearance, OptionsThatNoNetworkCanHaveAreRefusedAtOnce) {
  ChildResult refused = ceiling("ws", {"--resolution", "100"});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("resolution cannot be 100"));
  refused = ceiling("ws", {"--shading", "3"});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("with shading 3: they take powers of 2"));
  expect_nothing_of_ceiling("ws");
  if (!cuda_available()) {
    refused = ceiling("ws", {"--device", "cuda"});
    EXPECT_EQ(refused.exit_code, 5) << refused.err;
    expect_nothing_of_ceiling("ws");
  }
}

TEST_F(Appearance, ATrainingThatDivergesIsNoResult) {
  const ChildResult diverged = ceiling("ws", {"--learning-rate", "1"});
  EXPECT_EQ(diverged.exit_code, 4) << diverged.err;
  EXPECT_THAT(diverged.err, HasSubstr("below the"));
  EXPECT_THAT(diverged.err, HasSubstr("a smaller --learning-rate may help"));
  EXPECT_FALSE(fs::exists(folder_ / "ws" / "ceiling" / "current"));
}

TEST_F(Appearance, ALossThatIsNoNumberLeavesTheLastCheckpoint) {
  ASSERT_EQ(ceiling("ws").exit_code, 0);
  {
    const ChildProcess half(train("half.safetensors", "half.checkpoint"));
    while (!fs::exists(folder_ / "half.checkpoint") && !half.has_ended()) {
      std::this_thread::yield();
    }
    half.kill(SIGKILL);
  }
  // A moment that the next step cannot survive.
  const fs::path checkpoint = folder_ / "half.checkpoint";
  Safetensors state = read_safetensors(checkpoint);
  const std::string steps = state.metadata.at("iteration");
  state.metadata.erase("digest");  // the network is not damaged, it diverges
  for (auto& [name, tensor] : state.tensors) {
    if (name.starts_with("moment.m.")) {
      tensor = tensor_of(std::vector<float>(static_cast<std::size_t>(element_count(tensor)), 3e38F),
                         tensor.shape);
    }
  }
  write_safetensors(checkpoint, state);
  const std::string before = bytes_of(checkpoint);
  const ChildResult broken = run_child(train("x.safetensors", "half.checkpoint"));
  EXPECT_EQ(broken.exit_code, 4) << broken.err;
  EXPECT_THAT(broken.err, HasSubstr("no number any more after iteration " + steps +
                                    ", where the checkpoint stands"));
  EXPECT_EQ(bytes_of(checkpoint), before);
  EXPECT_FALSE(fs::exists(folder_ / "x.safetensors"));
}

TEST_F(Appearance, DrawsWhatIsRegisteredAndItsBodyInAnyMeshes) {
  const fs::path workspace = found();
  // Gently: 24 quick steps end below the all but perfect texture of a grey body.
  const ChildResult done = appearance(workspace, {"--body", "true", "--learning-rate", "1e-3"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  for (const char* surface : {"dress", "body"}) {
    EXPECT_TRUE(fs::exists(workspace / "appearance" / "current" / surface / "model.safetensors"));
  }
  const ChildResult figures = run_child({program_path(), "evaluate", workspace.string(), "--truth",
                                         capture_.string(), "--stage", "appearance"});
  EXPECT_THAT(figures.exit_code, ::testing::AnyOf(0, 1)) << figures.err;
  for (const char* key : {"appearance.psnr_db", "appearance.body_psnr_db",
                          "appearance.body_static_psnr_db", "appearance.body_covered"}) {
    EXPECT_THAT(figures.out, HasSubstr(key));
  }
  // The workspace's own meshes, by the held-out camera.
  std::vector<std::string> draw = {
      program_path(), "draw", workspace.string(), "--capture", capture_.string(), "--camera", "09"};
  const auto drawn = [&](const char* out, std::vector<std::string> more) {
    std::vector<std::string> words = draw;
    words.insert(words.end(), {"--out", (folder_ / out).string()});
    words.insert(words.end(), more.begin(), more.end());
    return run_child(words);
  };
  ChildResult pictures = drawn("own", {});
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  const ByteImage own = read_byte_image(folder_ / "own" / "000002.png");
  EXPECT_EQ(own.width, kSide);
  // Near what the camera took: cloth and body, whose pixels labels tell from the background.
  const ByteImage taken = read_byte_image(capture_ / "images" / "09" / "000002.png");
  const ByteImage labels = read_labels(capture_ / "labels" / "09" / "000002.png");
  double off = 0;
  double count = 0;
  for (std::size_t i = 0; i < labels.data.size(); ++i) {
    if (labels.data[i] != 0) {
      off += std::abs(own.data[3 * i] - taken.data[3 * i]);
      count += 1;
    }
  }
  EXPECT_LT(off / count, 30);
  // The same from a folder of plain meshes.
  for (const char* folder : {"meshes", "balls", "other"}) {
    fs::create_directories(folder_ / folder);
  }
  for (int f = 0; f < kFrames; ++f) {
    Mesh mesh = waving_cloth();
    mesh.vertices = cloth_at(mesh, f);
    write_mesh(folder_ / "meshes" / (digits(f) + ".ply"), mesh);
    write_mesh(folder_ / "balls" / (digits(f) + ".ply"), ball());
    write_mesh(folder_ / "other" / (digits(f) + ".ply"), grid(3, 3));
  }
  const std::string balls = (folder_ / "balls").string();
  const auto dress = [&](const char* folder) {
    return std::string("dress=") + (folder_ / folder).string();
  };
  // What is misspelt, and what does nothing beside a camera of a capture.
  pictures = drawn("none", {"--garment", "dres=x"});
  EXPECT_EQ(pictures.exit_code, 2);
  EXPECT_THAT(pictures.err, HasSubstr("did you mean 'dress'?"));
  pictures = drawn("none", {"--width", "64"});
  EXPECT_EQ(pictures.exit_code, 2);
  EXPECT_THAT(pictures.err, HasSubstr("--width does nothing"));
  pictures = run_child({program_path(), "draw", workspace.string(), "--capture", capture_.string(),
                        "--camera", "99", "--out", (folder_ / "none").string()});
  EXPECT_EQ(pictures.exit_code, 2);
  EXPECT_THAT(pictures.err, HasSubstr("no camera '99'; it has 00, 01, 02"));
  pictures = run_child({program_path(), "evaluate", workspace.string(), "--truth",
                        capture_.string(), "--stage", "apearance"});
  EXPECT_EQ(pictures.exit_code, 2);
  EXPECT_THAT(pictures.err, HasSubstr("did you mean 'appearance'?"));
  // Meshes of another topology are refused, and leave nothing in the way of the right ones.
  pictures = drawn("plain", {"--body", balls, "--garment", dress("other")});
  EXPECT_EQ(pictures.exit_code, 3) << pictures.err;
  EXPECT_FALSE(fs::exists(folder_ / "plain"));
  pictures = drawn("plain", {"--body", balls, "--garment", dress("meshes")});
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  const ByteImage plain = read_byte_image(folder_ / "plain" / "000002.png");
  double differ = 0;
  for (std::size_t i = 0; i < plain.data.size(); ++i) {
    differ += std::abs(plain.data[i] - own.data[i]);
  }
  EXPECT_LT(differ / static_cast<double>(plain.data.size()), 1);  // single precision of PLY
  // As a film, before nothing, and by a camera that goes round.
  pictures = drawn("film.mp4", {"--video.fps", "12"});
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  EXPECT_GT(fs::file_size(folder_ / "film.mp4"), 500U);
  pictures = drawn("clear", {"--alpha", "true"});
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  EXPECT_EQ(read_image_header(folder_ / "clear" / "000002.png").channels, 4);
  EXPECT_NE(read_file_text(folder_ / "clear" / "000002.png", 1 << 24),
            read_file_text(folder_ / "own" / "000002.png", 1 << 24));
  pictures = run_child({program_path(), "draw", workspace.string(), "--turn", "true", "--width",
                        "32", "--height", "40", "--out", (folder_ / "turned").string()});
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  EXPECT_NE(read_byte_image(folder_ / "turned" / "000000.png").data,
            read_byte_image(folder_ / "turned" / "000002.png").data);
  pictures = drawn("none", {"--video.fps", "12"});
  EXPECT_EQ(pictures.exit_code, 2);
  EXPECT_THAT(pictures.err, HasSubstr("--video.fps is of a video"));
  pictures = drawn("none", {"--alpha", "true", "--background", "[0, 1, 0]"});
  EXPECT_EQ(pictures.exit_code, 2);
  EXPECT_THAT(pictures.err, HasSubstr("--background does nothing with --alpha"));
  // A network in which a bit has flipped draws nothing, and is not judged.
  const fs::path network = workspace / "appearance" / "current" / "dress" / "model.safetensors";
  flip_last_bit(network);
  for (const ChildResult& refused :
       {drawn("damaged", {}), run_child({program_path(), "evaluate", workspace.string(), "--truth",
                                         capture_.string(), "--stage", "appearance"})}) {
    EXPECT_EQ(refused.exit_code, 3);
    EXPECT_THAT(refused.err, HasSubstr("dress/model.safetensors"));
    EXPECT_THAT(refused.err, HasSubstr("run 'atelier appearance' again"));
    EXPECT_EQ(refused.err.find("expected"), refused.err.rfind("expected")) << refused.err;
  }
  EXPECT_FALSE(fs::exists(folder_ / "damaged"));
  // Without its network a garment is not drawn grey, as a body is.
  fs::remove(network);
  pictures = drawn("bare", {});
  EXPECT_EQ(pictures.exit_code, 3);
  EXPECT_THAT(pictures.err, HasSubstr("no network"));
  EXPECT_FALSE(fs::exists(folder_ / "bare"));
  // Nor is one left out whose folder is gone.
  fs::remove_all(network.parent_path());
  pictures = drawn("bare", {});
  EXPECT_EQ(pictures.exit_code, 3);
  EXPECT_THAT(pictures.err, HasSubstr("no network"));
}

TEST_F(Appearance, DrawingRefusesAVideoOfAnotherKind) {
  for (const char* name : {"p.avi", "p.gif", "p.png"}) {
    const ChildResult refused = run_child(
        {program_path(), "draw", (folder_ / "any").string(), "--out", (folder_ / name).string()});
    EXPECT_EQ(refused.exit_code, 2) << name;
    EXPECT_THAT(refused.err, HasSubstr("a folder or a video .mp4"));
    EXPECT_FALSE(fs::exists(folder_ / name));
  }
}

TEST_F(Appearance, ATrainingReplacesNothingButItsOwnFiles) {
  const std::string data = (folder_ / "data.h5").string();
  const std::string model = (folder_ / "m.safetensors").string();
  const std::string notes = (folder_ / "notes.txt").string();
  const std::string link = (folder_ / "link.csv").string();
  const std::string pipe = (folder_ / "pipe").string();
  write_file_atomically(data, "not read yet");
  write_file_atomically(notes, "kept\n");
  fs::create_symlink("notes.txt", link);
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const auto train = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {network_program().string(), "train"});
    return run_child(words);
  };
  const std::string same = (folder_ / "." / "data.h5").string();
  for (const ChildResult& refused : {train({data, same}), train({data, model, "--log", same})}) {
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr("DATA and"));
    EXPECT_THAT(refused.err, HasSubstr("are one file"));
  }
  EXPECT_EQ(train({data, model, "--log", notes, "--checkpoint", notes}).exit_code, 2);
  for (const std::string& place : {link, pipe, std::string("/dev/null")}) {
    const ChildResult refused = train({data, model, "--log", place});
    EXPECT_EQ(refused.exit_code, 3) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr("expected a regular file"));
  }
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_TRUE(fs::is_symlink(link));
  ChildResult refused = train({data, model, "--log", notes});
  EXPECT_EQ(refused.exit_code, 3) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("no log of a training"));
  EXPECT_EQ(bytes_of(notes), "kept\n");
  // Before the data are read, which are none here.
  refused = train({data, (folder_ / "missing" / "m.safetensors").string()});
  EXPECT_EQ(refused.exit_code, 5) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("make the folder first"));
  EXPECT_EQ(bytes_of(data), "not read yet");
}

TEST_F(Appearance, CommandsOnFilesTakeTheirOwnOptionsAlone) {
  const std::string program = network_program().string();
  const ChildResult refused = run_child({program, "predict", "m", "d", "c", "--iterations", "3"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("iterations"));
  const ChildResult help = run_child({program, "train", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("--weight_decay <"));
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
