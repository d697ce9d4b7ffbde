#include "capture/layouts/mvhumannet.h"

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

#include "capture/camera_conventions.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/json_numbers.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/json.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const WorldConvention kMvHumanNetWorld = {0, ""};
const WorldConvention kMvHumanNetWritten = {1, "y"};

/// "CC32871A004" of "1_CC32871A004.png".
std::string camera_name(const std::string& key) {
  const std::string stem = fs::path(key).stem().string();
  const std::size_t line = stem.find('_');
  const bool number =
      line != std::string::npos && line > 0 && stem.find_first_not_of("0123456789") == line;
  return number ? stem.substr(line + 1) : stem;
}

}  // namespace

std::optional<double> pickled_number(std::span<const std::byte> bytes) {
  // PROTO n, FRAME size, BINFLOAT (big-endian), MEMOIZE, STOP: what pickle writes for a float.
  std::size_t at = 0;
  const auto take = [&](int op) {
    const bool is = at < bytes.size() && std::to_integer<int>(bytes[at]) == op;
    at += is ? 1 : 0;
    return is;
  };
  constexpr int kProto = 0x80;
  constexpr int kFrame = 0x95;
  constexpr std::size_t kFrameBytes = 8;
  if (!take(kProto)) {
    return std::nullopt;
  }
  ++at;
  if (take(kFrame)) {
    at += kFrameBytes;
  }
  if (!take('G') || bytes.size() < at + sizeof(double)) {
    return std::nullopt;
  }
  ByteReader reader(bytes.subspan(at, sizeof(double)), "");
  const auto value = reader.big<double>("number");
  at += sizeof(double);
  if (!take('.') || at != bytes.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

std::string recognize_mvhumannet(const fs::path& path) {
  return fs::is_regular_file(path / "camera_extrinsics.json") &&
                 fs::is_regular_file(path / "camera_intrinsics.json")
             ? "camera_extrinsics.json and camera_intrinsics.json"
             : "";
}

std::vector<Camera> parse_mvhumannet_cameras(std::string_view intrinsics,
                                             std::string_view extrinsics, const std::string& file,
                                             const Limits& limits) {
  const std::string in_file =
      file.empty() ? "camera_intrinsics.json" : file + "/camera_intrinsics.json";
  const std::string ex_file =
      file.empty() ? "camera_extrinsics.json" : file + "/camera_extrinsics.json";
  const nlohmann::json in_json = parse_python_json(intrinsics, in_file, limits);
  const nlohmann::json ex_json = parse_python_json(extrinsics, ex_file, limits);
  const JsonPlace in(in_json, in_file);
  const JsonPlace ex(ex_json, ex_file);
  if (!ex_json.is_object() || static_cast<std::int64_t>(ex_json.size()) > limits.cameras) {
    ex.fail("no object of at most " + std::to_string(limits.cameras) + " cameras",
            "{\"1_<camera>.png\": {...}}");
  }
  std::vector<Camera> cameras;
  for (const auto& [key, value] : ex_json.items()) {
    const JsonPlace entry = ex.at(key);
    OpencvCamera camera;
    camera.id = camera_name(key);
    // One K for all, or one for each camera.
    const JsonPlace own = in.has(key) ? in.at(key) : in.has(camera.id) ? in.at(camera.id) : in;
    if (own.has("intrinsics")) {
      camera.matrix = matrix3_of(own.at("intrinsics"));
    } else {
      // Some releases have the numbers in the extrinsics.
      const std::vector<double> focal = all_numbers(entry.at("focal_length"));
      const std::vector<double> center = all_numbers(entry.at("image_center"));
      if (focal.empty() || focal.size() > 2 || center.size() != 2) {
        entry.fail("no focal lengths or centre", "focal_length and image_center, two numbers each");
      }
      camera.matrix << focal.front(), 0, center[0], 0, focal.back(), center[1], 0, 0, 1;
    }
    if (const auto distortion = own.find("dist")) {
      camera.distortion = all_numbers(*distortion);
    }
    read_pose(camera, entry, "rotation", "translation");
    cameras.push_back(camera_of(camera, ex_file));
  }
  return cameras;
}

Dataset read_mvhumannet(const fs::path& path, const DatasetOptions& options, const Limits& limits) {
  Dataset dataset;
  dataset.root = path;
  dataset.cameras = parse_mvhumannet_cameras(
      read_file_text(path / "camera_intrinsics.json", limits.text_file_bytes),
      read_file_text(path / "camera_extrinsics.json", limits.text_file_bytes), path.string(),
      limits);
  dataset.frames.resize(dataset.cameras.size());
  dataset.world_convention = kMvHumanNetWorld;
  const fs::path scale = path / "camera_scale.pkl";
  constexpr std::int64_t kSmall = 4096;
  if (fs::is_regular_file(scale) && fs::file_size(scale) <= kSmall) {
    const std::optional<double> number = pickled_number(read_file_bytes(scale, kSmall));
    if (number && *number > 0) {
      dataset.world_convention.metres_per_unit = *number;
    }
  }
  if (!(dataset.world_convention.metres_per_unit > 0) && !(options.metres_per_unit > 0)) {
    dataset.findings.push_back(
        {Severity::Error, "camera-scale", scale.string(),
         "translations are no metres before they are multiplied by the number in camera_scale.pkl, "
         "which is missing or a pickle that runs code when it is read",
         "print it with: python3 -c \"import pickle; print(float(pickle.load(open("
         "'camera_scale.pkl','rb'))))\" and give it to --metres-per-unit"});
  }
  dataset.keypoint_shift = 0.5;
  dataset.info.keypoint_schema.clear();
  dataset = with_pictures(std::move(dataset), &CameraFrames::images, path / "images", limits);
  dataset = with_pictures(std::move(dataset), &CameraFrames::masks, path / "fmask", limits);
  if (fs::is_directory(path / "openpose")) {
    dataset = with_keypoints(std::move(dataset), path / "openpose", limits);
  } else {
    dataset.keypoint_file = KeypointFile::EasyMocap;
    dataset = with_keypoints(std::move(dataset), path / "annots", limits);
  }
  return dataset;
}

std::vector<std::string> write_mvhumannet(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {
      "frame rate and labels are left out (masks of the person are kept)",
      "one intrinsics file holds a matrix for each camera, which the layout's own tools do not "
      "expect"};
  nlohmann::ordered_json intrinsics;
  nlohmann::ordered_json extrinsics;
  const std::vector<Camera> cameras = cameras_in(source, kMvHumanNetWritten);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    const OpencvCamera opencv = opencv_of(camera);
    const std::string key = "1_" + camera.id + ".png";
    intrinsics[key]["intrinsics"] = rows_json(opencv.matrix);
    intrinsics[key]["dist"] = five_distortion(camera, lost);
    const Eigen::Quaterniond q(opencv.rotation);
    const Eigen::Vector3d center = camera_center(camera);
    const Eigen::Vector3d& t = opencv.translation;
    nlohmann::ordered_json& entry = extrinsics[key];
    entry["focal_length"] = {opencv.matrix(0, 0), opencv.matrix(1, 1)};
    entry["image_center"] = {opencv.matrix(0, 2), opencv.matrix(1, 2)};
    entry["translation"] = {t.x(), t.y(), t.z()};
    entry["camera_pos"] = {center.x(), center.y(), center.z()};
    entry["quaternion"] = {q.w(), q.x(), q.y(), q.z()};
    entry["rotation"] = rows_json(opencv.rotation);
    if (camera.gain != Eigen::Vector3d::Ones()) {
      lost.emplace_back("gains of the cameras are left out");
    }
    for (const int frame : source.sequence.frame_ids) {
      const auto index = static_cast<Index>(c);
      write_picture(source, index, frame, out / "images" / camera.id / frame_name(frame));
      write_mask(source, index, frame, out / "fmask" / camera.id / (frame_name(frame) + ".png"));
      write_keypoints(source, index, frame,
                      out / "openpose" / camera.id / (frame_name(frame) + "_keypoints.json"), 0.5);
    }
  }
  // The pickle of the float 1.0, protocol 2.
  write_file_atomically(out / "camera_scale.pkl",
                        std::string("\x80\x02G\x3f\xf0\0\0\0\0\0\0.", 12));
  write_file_atomically(out / "camera_intrinsics.json", intrinsics.dump(1) + "\n");
  write_file_atomically(out / "camera_extrinsics.json", extrinsics.dump(1) + "\n");
  return lost;
}

}  // namespace atelier
