#include "capture/layouts/panoptic.h"

#include <nlohmann/json.hpp>

#include "capture/camera_conventions.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/json_numbers.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/json.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const WorldConvention kPanopticWorld = {0.01, "-y"};
constexpr double kPanopticFps = 29.97;

fs::path panoptic_calibration(const fs::path& path) {
  const auto is_one = [](const fs::path& file) {
    const std::string name = file.filename().string();
    return name.starts_with("calibration_") && name.ends_with(".json") &&
           name != "calibration_full.json";
  };
  if (fs::is_regular_file(path)) {
    return is_one(path) ? path : fs::path();
  }
  for (const fs::path& file : files_ending(path, ".json")) {
    if (is_one(file)) {
      return file;
    }
  }
  return {};
}

std::string hd_number(std::size_t i) {
  return (i < 10 ? "0" : "") + std::to_string(i);
}

}  // namespace

std::string recognize_panoptic(const fs::path& path) {
  const fs::path file = panoptic_calibration(path);
  return file.empty() ? "" : file.filename().string();
}

std::vector<Camera> parse_panoptic_cameras(std::string_view text, const std::string& file,
                                           const Limits& limits) {
  const nlohmann::json parsed = parse_python_json(text, file, limits);
  const std::vector<JsonPlace> items = JsonPlace(parsed, file).at("cameras").items();
  if (static_cast<std::int64_t>(items.size()) > limits.cameras) {
    throw DataError(file, "cameras", std::to_string(items.size()),
                    "at most " + std::to_string(limits.cameras));
  }
  std::vector<Camera> cameras;
  for (const JsonPlace& entry : items) {
    OpencvCamera camera;
    camera.id = entry.at("name").text();
    const std::vector<JsonPlace> size = entry.at("resolution").items();
    if (size.size() != 2) {
      entry.fail(std::to_string(size.size()) + " numbers of resolution", "width and height");
    }
    camera.width = pixels_of(size[0]);
    camera.height = pixels_of(size[1]);
    camera.matrix = matrix3_of(entry.at("K"));
    camera.distortion = entry.at("distCoef").numbers();
    read_pose(camera, entry, "R", "t");
    cameras.push_back(camera_of(camera, file));
  }
  return cameras;
}

Dataset read_panoptic(const fs::path& path, const DatasetOptions& /*options*/,
                      const Limits& limits) {
  const fs::path file = panoptic_calibration(path);
  if (file.empty()) {
    throw DataError(path.string(), "", "no calibration_*.json", "the calibration of the sequence");
  }
  Dataset dataset;
  dataset.root = file.parent_path();
  dataset.cameras =
      parse_panoptic_cameras(read_file_text(file, limits.text_file_bytes), file.string(), limits);
  dataset.frames.resize(dataset.cameras.size());
  dataset.world_convention = kPanopticWorld;
  dataset.info.keypoint_schema.clear();
  for (const std::string kind : {"hd", "vga", "kinect"}) {
    for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
      FrameLocations& images = dataset.frames[c].images;
      const std::string& id = dataset.cameras[c].id;
      if (images.empty()) {
        images = camera_pictures(dataset.root / (kind + "Imgs"), id, limits);
      }
      if (images.empty()) {
        std::string video = kind;
        video.append("_").append(id);  // hd_00_05.mp4
        images = camera_pictures(dataset.root / (kind + "Videos"), video, limits);
      }
    }
  }
  // The calibration lists 520 cameras; usable are those whose images are there.
  dataset = with_pictured_cameras(std::move(dataset));
  dataset.keypoints3d = numbered_files(dataset.root / "hdPose3d_stage1_coco19", {".json"}, limits);
  dataset.keypoint_schema_3d = "coco_19";
  dataset.info.sequences.push_back({"capture", "clothed", kPanopticFps, {}});
  return dataset;
}

std::vector<std::string> write_panoptic(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {
      "detected keypoints, masks and labels are left out; the frame rate of the layout is "
      "29.97",
      "cameras are called 00_00, 00_01, ..."};
  nlohmann::ordered_json root;
  root["calibDataSource"] = source.sequence.name;
  root["cameras"] = nlohmann::ordered_json::array();
  const std::vector<Camera> cameras = cameras_in(source, kPanopticWorld);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    const OpencvCamera opencv = opencv_of(camera);
    const std::string name = "00_" + hd_number(c);
    nlohmann::ordered_json entry;
    entry["name"] = name;
    entry["type"] = "hd";
    entry["resolution"] = {camera.width, camera.height};
    entry["panel"] = 0;
    entry["node"] = c;
    entry["K"] = rows_json(opencv.matrix);
    entry["distCoef"] = five_distortion(camera, lost);
    entry["R"] = rows_json(opencv.rotation);
    entry["t"] = rows_json(opencv.translation);
    root["cameras"].push_back(entry);
    if (camera.gain != Eigen::Vector3d::Ones()) {
      lost.emplace_back("gains of the cameras are left out");
    }
    for (const int frame : source.sequence.frame_ids) {
      write_picture(source, static_cast<Index>(c), frame,
                    out / "hdImgs" / name / (name + "_00" + frame_name(frame)));
    }
  }
  write_file_atomically(out / ("calibration_" + source.sequence.name + ".json"),
                        root.dump(1) + "\n");
  return lost;
}

}  // namespace atelier
