#include "capture/layouts/avatarrex.h"

#include <nlohmann/json.hpp>

#include "capture/camera_conventions.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/json_numbers.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/json.h"
#include "core/printable.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const WorldConvention kAvatarRexWorld = {1, ""};
const WorldConvention kAvatarRexWritten = {1, "y"};

/// Eight digits, as both data sets have them.
std::string eight_digits(int frame) {
  return "00" + frame_name(frame);
}

std::vector<double> flat(const Eigen::Matrix3d& matrix) {
  std::vector<double> values;
  for (Index i = 0; i < 9; ++i) {
    values.push_back(matrix(i / 3, i % 3));
  }
  return values;
}

Dataset read_cameras_of(const fs::path& file, const Limits& limits) {
  Dataset dataset;
  dataset.root = file.parent_path();
  dataset.cameras =
      parse_avatarrex_cameras(read_file_text(file, limits.text_file_bytes), file.string(), limits);
  dataset.frames.resize(dataset.cameras.size());
  dataset.world_convention = kAvatarRexWorld;
  dataset.info.keypoint_schema.clear();
  if (fs::exists(dataset.root / "missing_img_files.txt")) {
    dataset.findings.push_back({Severity::Note, "missing-frames-listed",
                                (dataset.root / "missing_img_files.txt").string(),
                                "the data set says that some images are missing",
                                "nothing: frames are those that are there"});
  }
  return dataset;
}

/// Writes everything; `picture` and `mask` say where.
template <class Picture, class Mask>
std::vector<std::string> write_files(const LayoutSource& source, const fs::path& file,
                                     const Picture& picture, const Mask& mask) {
  std::vector<std::string> lost = {
      "frame rate, keypoints and labels are left out (masks of the person are kept)"};
  nlohmann::ordered_json root;
  const std::vector<Camera> cameras = cameras_in(source, kAvatarRexWritten);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    const OpencvCamera opencv = opencv_of(camera);
    const Eigen::Vector3d& t = opencv.translation;
    nlohmann::ordered_json& entry = root[camera.id];
    entry["K"] = flat(opencv.matrix);
    entry["R"] = flat(opencv.rotation);
    entry["T"] = {t.x(), t.y(), t.z()};
    entry["imgSize"] = {camera.width, camera.height};
    entry["distCoeff"] = five_distortion(camera, lost);
    if (camera.gain != Eigen::Vector3d::Ones()) {
      lost.emplace_back("gains of the cameras are left out");
    }
    for (const int frame : source.sequence.frame_ids) {
      const auto index = static_cast<Index>(c);
      write_picture(source, index, frame, picture(camera.id) / eight_digits(frame));
      write_mask(source, index, frame, mask(camera.id) / (eight_digits(frame) + ".png"));
    }
  }
  write_file_atomically(file, root.dump(1) + "\n");
  return lost;
}

}  // namespace

std::string recognize_avatarrex(const fs::path& path) {
  return fs::is_regular_file(path / "calibration_full.json") ? "calibration_full.json" : "";
}

std::string recognize_thuman4(const fs::path& path) {
  return fs::is_regular_file(path / "calibration.json") ? "calibration.json" : "";
}

std::vector<Camera> parse_avatarrex_cameras(std::string_view text, const std::string& file,
                                            const Limits& limits) {
  const nlohmann::json parsed = parse_python_json(text, file, limits);
  const JsonPlace root(parsed, file);
  if (!parsed.is_object() || parsed.empty() ||
      static_cast<std::int64_t>(parsed.size()) > limits.cameras) {
    root.fail("no object of cameras",
              "1 to " + std::to_string(limits.cameras) + " cameras with K, R, T and imgSize");
  }
  std::vector<Camera> cameras;
  for (const auto& [key, value] : parsed.items()) {
    const JsonPlace entry = root.at(key);
    OpencvCamera camera;
    camera.id = key;
    camera.matrix = matrix3_of(entry.at("K"));
    read_pose(camera, entry, "R", "T");
    if (const auto size = entry.find("imgSize")) {
      const std::vector<JsonPlace> sides = size->items();
      if (sides.size() != 2) {
        size->fail(counted(static_cast<std::int64_t>(sides.size()), "number"), "width and height");
      }
      camera.width = pixels_of(sides[0]);
      camera.height = pixels_of(sides[1]);
    }
    if (const auto distortion = entry.find("distCoeff")) {
      camera.distortion = all_numbers(*distortion);
    }
    cameras.push_back(camera_of(camera, file));
  }
  return cameras;
}

Dataset read_avatarrex(const fs::path& path, const DatasetOptions& /*options*/,
                       const Limits& limits) {
  Dataset dataset = read_cameras_of(path / "calibration_full.json", limits);
  dataset = with_pictures(std::move(dataset), &CameraFrames::images, path, limits);
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    dataset.frames[c].masks =
        numbered_files(path / dataset.cameras[c].id / "mask" / "pha", {}, limits);
  }
  return dataset;
}

Dataset read_thuman4(const fs::path& path, const DatasetOptions& /*options*/,
                     const Limits& limits) {
  Dataset dataset = read_cameras_of(path / "calibration.json", limits);
  dataset = with_pictures(std::move(dataset), &CameraFrames::images, path / "images", limits);
  return with_pictures(std::move(dataset), &CameraFrames::masks, path / "masks", limits);
}

std::vector<std::string> write_avatarrex(const LayoutSource& source, const fs::path& out) {
  return write_files(
      source, out / "calibration_full.json", [&](const std::string& id) { return out / id; },
      [&](const std::string& id) { return out / id / "mask" / "pha"; });
}

std::vector<std::string> write_thuman4(const LayoutSource& source, const fs::path& out) {
  return write_files(
      source, out / "calibration.json", [&](const std::string& id) { return out / "images" / id; },
      [&](const std::string& id) { return out / "masks" / id; });
}

}  // namespace atelier
