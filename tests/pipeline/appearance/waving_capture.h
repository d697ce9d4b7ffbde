#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "capture/capture_info.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/io/cameras_file.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/raster.h"
#include "core/sequence_archive.h"
#include "core/store/run_stage.h"
#include "tests/support/places.h"
#include "tests/support/shapes.h"

namespace atelier::fixtures {

/// A capture made by hand: a cloth that waves over a ball, seen by ten small cameras from above.
/// All names are the struct's, so that they are no other test's.
struct WavingCapture {
  static constexpr int kSide = 56;
  static constexpr int kFrames = 4;  // the last one is held out, and so is the last camera
  static constexpr int kCameras = 10;

  static std::filesystem::path network_program() {
    return std::filesystem::path(program_path()).parent_path() / "atelier-appearance";
  }

  static std::string bytes_of(const std::filesystem::path& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
  }

  /// Of a file of tensors: in the last element of the last one.
  static void flip_last_bit(const std::filesystem::path& path) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(-1, std::ios::end);
    const int last = file.get();
    file.seekp(-1, std::ios::end);
    file.put(static_cast<char>(last ^ 1));
  }

  static std::string digits(int frame) {
    char text[16];
    std::snprintf(text, sizeof text, "%06d", frame);
    return text;
  }

  static Camera camera_of(int i) {
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

  static Mesh waving_cloth() {
    Mesh cloth = grid(8, 8);
    cloth.uvs.resize(cloth.vertices.rows(), 2);
    cloth.uvs.col(0) = cloth.vertices.col(0);
    cloth.uvs.col(1) = 1 - cloth.vertices.col(2).array();
    cloth.uv_faces = cloth.faces;
    return cloth;
  }

  static Points cloth_at(const Mesh& cloth, int frame) {
    Points vertices = cloth.vertices;
    for (Index v = 0; v < vertices.rows(); ++v) {
      vertices(v, 1) = 1 + 0.06 * std::sin(7 * vertices(v, 0) + 1.3 * frame);
    }
    return vertices;
  }

  /// An image as a light from the left would make it of a checked cloth over a grey ball, and its
  /// labels.
  static void take_picture(const std::filesystem::path& capture, const Mesh& cloth,
                           const Mesh& ball, const Camera& camera, int frame) {
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
  static Mesh ball() {
    Mesh mesh = sphere(2);
    mesh.uvs.resize(mesh.vertices.rows(), 2);
    mesh.uvs.col(0) = (0.5 + 0.4 * mesh.vertices.col(0).array()).matrix();
    mesh.uvs.col(1) = (0.5 + 0.4 * mesh.vertices.col(2).array()).matrix();
    mesh.uv_faces = mesh.faces;
    mesh.vertices *= 0.3;
    mesh.vertices.rowwise() += Eigen::RowVector3d(-0.15, 0.6, 0.5);
    return mesh;
  }

  static void make_capture(const std::filesystem::path& capture) {
    GroundTruth truth;
    truth.skeleton.names = {"pelvis"};
    truth.skeleton.parents = {-1};
    truth.skeleton.offsets = Points::Zero(1, 3);
    truth.body = ball();
    truth.shape_names = {"stature"};
    truth.shape = Eigen::VectorXd::Constant(1, 1.7);
    truth.keypoint_names = {"nose"};
    GroundTruthGarment garment;
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
        std::filesystem::create_directories(capture / kind / truth.cameras.back().id);
      }
    }
    std::filesystem::create_directories(capture / "truth" / "frames");
    for (int f = 0; f < kFrames; ++f) {
      sequence.frame_ids.push_back(f);
      for (const Camera& camera : truth.cameras) {
        take_picture(capture, cloth, truth.body, camera, f);
      }
      GroundTruthFrame frame;
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

  /// The ground truth of the capture as if stages had found it.
  static void write_found(StageRun& run, const std::string& folder, const Mesh& mesh,
                          const std::function<Points(int)>& at) {
    SequenceHeader header;
    header.fps = 12;
    header.shared = mesh;
    header.shared.vertices.resize(0, 3);
    for (int f = 0; f < kFrames; ++f) {
      header.frame_ids.push_back(f);
    }
    run.output((std::filesystem::path(folder) / "sequence.h5").generic_string(),
               [&](const auto& file) { write_archive(file, archive_of(header)); });
    for (int f = 0; f < kFrames; ++f) {
      Mesh frame;
      frame.vertices = at(f);
      run.output(sequence_frame_path(folder, f).generic_string(),
                 [&](const auto& file) { write_mesh_archive(file, frame); });
    }
  }
};

}  // namespace atelier::fixtures
