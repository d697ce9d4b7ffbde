#include "capture/layouts/human36m.h"

#include <nlohmann/json.hpp>

#include "capture/camera_conventions.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/json_numbers.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/json.h"
#include "core/unknown_value.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const WorldConvention kHuman36mWorld = {0.001, "z"};
constexpr double kHuman36mFps = 50;

/// Rows of the images of the data set's own four cameras; they are 1000 pixels wide.
int known_height(const std::string& id) {
  if (id == "54138969" || id == "60457274") {
    return 1002;
  }
  return id == "55011271" || id == "58860488" ? 1000 : 0;
}

fs::path human36m_calibration(const fs::path& path) {
  if (fs::is_regular_file(path)) {
    return path.filename().string().ends_with("camera-parameters.json") ? path : fs::path();
  }
  const std::vector<fs::path> files = files_ending(path, "camera-parameters.json");
  return files.empty() ? fs::path() : files.front();
}

}  // namespace

std::string recognize_human36m(const fs::path& path) {
  const fs::path file = human36m_calibration(path);
  return file.empty() ? "" : file.filename().string();
}

std::vector<Camera> parse_human36m_cameras(std::string_view text, const std::string& subject,
                                           const std::string& file, const Limits& limits) {
  const nlohmann::json parsed = parse_python_json(text, file, limits);
  const JsonPlace root(parsed, file);
  const JsonPlace subjects = root.at("extrinsics");
  const JsonPlace intrinsics = root.at("intrinsics");
  if (!subjects.value().is_object() || subjects.value().empty()) {
    subjects.fail("no subjects", "an object of cameras for each");
  }
  std::string name = subject;
  if (subject == "auto") {
    // A file that was downloaded may have many subjects; those of no camera are passed over.
    for (const auto& [key, value] : subjects.value().items()) {
      if (value.is_object() && !value.empty()) {
        name = key;
        break;
      }
    }
  }
  if (!subjects.has(name)) {
    std::string known;
    for (const auto& [key, value] : subjects.value().items()) {
      known += (known.empty() ? "" : ", ") + key.substr(0, 20);
    }
    throw UnknownValue(file, "capture.subject", name, "one of " + known.substr(0, 200));
  }
  const JsonPlace extrinsics = subjects.at(name);
  if (!extrinsics.value().is_object() ||
      static_cast<std::int64_t>(extrinsics.value().size()) > limits.cameras) {
    extrinsics.fail("no object of cameras", "at most " + std::to_string(limits.cameras));
  }
  std::vector<Camera> cameras;
  for (const auto& [id, value] : extrinsics.value().items()) {
    const JsonPlace pose = extrinsics.at(id);
    const JsonPlace lens = intrinsics.at(id);
    OpencvCamera camera;
    camera.id = id;
    camera.height = known_height(id);
    camera.width = camera.height > 0 ? 1000 : 0;
    camera.matrix = matrix3_of(lens.at("calibration_matrix"));
    camera.distortion = all_numbers(lens.at("distortion"));
    read_pose(camera, pose, "R", "t");
    cameras.push_back(camera_of(camera, file));
  }
  return cameras;
}

Dataset read_human36m(const fs::path& path, const DatasetOptions& options, const Limits& limits) {
  const fs::path file = human36m_calibration(path);
  if (file.empty()) {
    throw DataError(path.string(), "", "no camera-parameters.json", "the calibration");
  }
  const fs::path root = file.parent_path();
  Dataset dataset;
  dataset.root = root;
  dataset.cameras = parse_human36m_cameras(read_file_text(file, limits.text_file_bytes),
                                           options.subject, file.string(), limits);
  dataset.frames.resize(dataset.cameras.size());
  dataset.world_convention = kHuman36mWorld;
  dataset.info.keypoint_schema.clear();
  dataset.info.subject = options.subject == "auto" ? "" : options.subject;
  for (const char* base : {"images", "videos"}) {
    dataset = with_pictures(std::move(dataset), &CameraFrames::images, root / base, limits);
  }
  dataset.info.sequences.push_back({"capture", "clothed", kHuman36mFps, {}});
  return dataset;
}

std::vector<std::string> write_human36m(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {
      "sizes of images, keypoints, masks and labels are left out; the frame rate of the "
      "layout is 50"};
  nlohmann::ordered_json root;
  const std::string subject =
      source.dataset().info.subject.empty() ? "S1" : source.dataset().info.subject;
  const std::vector<Camera> cameras = cameras_in(source, kHuman36mWorld);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    const OpencvCamera opencv = opencv_of(camera);
    root["intrinsics"][camera.id]["calibration_matrix"] = rows_json(opencv.matrix);
    root["intrinsics"][camera.id]["distortion"] = five_distortion(camera, lost);
    root["extrinsics"][subject][camera.id]["R"] = rows_json(opencv.rotation);
    root["extrinsics"][subject][camera.id]["t"] = rows_json(opencv.translation);
    if (camera.gain != Eigen::Vector3d::Ones()) {
      lost.emplace_back("gains of the cameras are left out");
    }
    for (const int frame : source.sequence.frame_ids) {
      write_picture(source, static_cast<Index>(c), frame,
                    out / "images" / camera.id / frame_name(frame));
    }
  }
  write_file_atomically(out / "camera-parameters.json", root.dump(1) + "\n");
  return lost;
}

}  // namespace atelier
