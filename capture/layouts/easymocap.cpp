#include "capture/layouts/easymocap.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "capture/camera_conventions.h"
#include "capture/keypoints3d_file.h"
#include "capture/layouts/camera_side.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/opencv_yaml.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/text_scanner.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const WorldConvention kEasyMocapWorld = {1, "z"};

const RowMatrix& matrix_of_key(const OpencvYaml& yaml, const std::string& key, Index rows,
                               Index cols, const std::string& file) {
  const auto found = yaml.matrices.find(key);
  if (found == yaml.matrices.end()) {
    throw DataError(file, key, "no such matrix", "one for each camera of names");
  }
  const RowMatrix& matrix = found->second;
  if (!(matrix.rows() == rows && matrix.cols() == cols) &&
      !(rows != cols && matrix.rows() == cols && matrix.cols() == rows)) {
    throw DataError(file, key,
                    std::to_string(matrix.rows()) + " x " + std::to_string(matrix.cols()),
                    std::to_string(rows) + " x " + std::to_string(cols));
  }
  if (matrix.hasNaN()) {
    throw DataError(file, key, "a number that is none", "a finite number");
  }
  return matrix;
}

int size_of(const OpencvYaml& yaml, const std::string& key, const std::string& file) {
  const auto found = yaml.scalars.find(key);
  if (found == yaml.scalars.end()) {
    return 0;
  }
  double value = 0;  // some write 1080.
  if (!parse_number(found->second, value) || !is_camera_side(std::floor(value))) {
    throw DataError(file, key, in_quotes(found->second), "pixels");
  }
  return saturating_cast<int>(value);
}

std::vector<std::string> names_of(const OpencvYaml& yaml, const std::string& file) {
  const auto found = yaml.lists.find("names");
  if (found == yaml.lists.end() || found->second.empty()) {
    throw DataError(file, "names", "no list of cameras", "names: and a line - \"id\" for each");
  }
  return found->second;
}

std::string names_yaml(const std::vector<Camera>& cameras) {
  std::string text = "%YAML:1.0\n---\nnames:\n";
  for (const Camera& camera : cameras) {
    text += "   - \"" + camera.id + "\"\n";
  }
  return text;
}

/// EasyMocap's annotation of one image.
std::string annotation(const LayoutSource& source, Index camera_idx, int frame,
                       const std::string& file_name) {
  const Camera& camera = source.cameras()[static_cast<std::size_t>(camera_idx)];
  nlohmann::ordered_json root;
  root["filename"] = camera.id + "/" + file_name;
  root["height"] = camera.height;
  root["width"] = camera.width;
  root["annots"] = nlohmann::ordered_json::array();
  int order = 0;
  for (const PersonKeypoints& person : source.frames().keypoints(camera_idx, frame)) {
    nlohmann::ordered_json entry;
    entry["personID"] = person.id >= 0 ? person.id : order;
    ++order;
    nlohmann::ordered_json points = nlohmann::ordered_json::array();
    Eigen::Vector2d low(1e9, 1e9);
    Eigen::Vector2d high(-1e9, -1e9);
    double best = 0;
    for (Index i = 0; i < person.points.rows(); ++i) {
      const double confidence = person.points(i, 2);
      // Keypoints that were not found stay 0, 0, 0.
      const double shift = person.points.row(i).isZero(0) ? 0 : 0.5;
      const Eigen::Vector2d at(person.points(i, 0) - shift, person.points(i, 1) - shift);
      points.push_back({at.x(), at.y(), confidence});
      if (confidence > 0) {
        low = low.cwiseMin(at);
        high = high.cwiseMax(at);
        best = std::max(best, confidence);
      }
    }
    if (best > 0) {
      entry["bbox"] = {low.x(), low.y(), high.x(), high.y(), best};
    } else {
      entry["bbox"] = {0, 0, camera.width, camera.height, 0};
    }
    entry["keypoints"] = points;
    entry["isKeyframe"] = false;
    root["annots"].push_back(entry);
  }
  return root.dump() + "\n";
}

}  // namespace

std::string recognize_easymocap(const fs::path& path) {
  if (fs::exists(path / "intri.yml") && fs::exists(path / "extri.yml")) {
    return "intri.yml and extri.yml";
  }
  return fs::exists(path / "annots.npy") ? "annots.npy of ZJU-MoCap" : "";
}

std::vector<Camera> parse_easymocap_cameras(std::string_view intrinsics,
                                            std::string_view extrinsics, const std::string& file,
                                            const Limits& limits) {
  const std::string intri = file.empty() ? "intri.yml" : file + "/intri.yml";
  const std::string extri = file.empty() ? "extri.yml" : file + "/extri.yml";
  const OpencvYaml in = parse_opencv_yaml(intrinsics, intri, limits);
  const OpencvYaml ex = parse_opencv_yaml(extrinsics, extri, limits);
  const std::vector<std::string> names = names_of(in, intri);
  std::vector<std::string> sorted = names;
  std::vector<std::string> others = names_of(ex, extri);
  std::sort(sorted.begin(), sorted.end());
  std::sort(others.begin(), others.end());
  // A camera of intri.yml alone has no pose.
  if (!std::includes(sorted.begin(), sorted.end(), others.begin(), others.end())) {
    throw DataError(extri, "names", "other cameras than those of intri.yml", "the same names");
  }
  if (static_cast<std::int64_t>(names.size()) > limits.cameras) {
    throw DataError(intri, "names", std::to_string(names.size()) + " cameras",
                    "at most " + std::to_string(limits.cameras));
  }
  std::vector<Camera> cameras;
  for (const std::string& name : names) {
    OpencvCamera camera;
    camera.id = name;
    camera.matrix = matrix_of_key(in, "K_" + name, 3, 3, intri);
    const auto coefficients = in.matrices.contains("dist_" + name)
                                  ? in.matrices.find("dist_" + name)
                                  : in.matrices.find("D_" + name);
    if (coefficients != in.matrices.end()) {
      const RowMatrix& d = coefficients->second;
      camera.distortion.assign(d.data(), d.data() + d.size());
    }
    camera.height = size_of(in, "H_" + name, intri);
    camera.width = size_of(in, "W_" + name, intri);
    if ((camera.height == 0) != (camera.width == 0)) {
      throw DataError(intri, "H_" + name, "one of H and W alone", "both or none");
    }
    const auto has = [&](const std::string& key) {  // OpenCV writes 0 x 0 for none
      const auto found = ex.matrices.find(key + name);
      return found != ex.matrices.end() && found->second.size() > 0 && !found->second.hasNaN();
    };
    const bool has_vector = has("R_");
    if ((!has_vector && !has("Rot_")) || !has("T_")) {
      camera.rotation.setZero();  // open_dataset leaves it out
      cameras.push_back(camera_of(camera, intri));
      continue;
    }
    if (has_vector) {
      const RowMatrix& r = matrix_of_key(ex, "R_" + name, 3, 1, extri);
      camera.rotation = rotation_of_vector({r.data()[0], r.data()[1], r.data()[2]});
    }
    if (!has_vector || has("Rot_")) {
      const Eigen::Matrix3d matrix = matrix_of_key(ex, "Rot_" + name, 3, 3, extri);
      constexpr double kAgree = 1e-3;
      if (has_vector && !((matrix - camera.rotation).norm() < kAgree)) {
        throw DataError(extri, "Rot_" + name, "another rotation than R_" + name,
                        "the same: readers of this layout use one or the other");
      }
      if (!has_vector) {
        camera.rotation = matrix;
      }
    }
    const RowMatrix& t = matrix_of_key(ex, "T_" + name, 3, 1, extri);
    camera.translation = {t.data()[0], t.data()[1], t.data()[2]};
    cameras.push_back(camera_of(camera, intri));
  }
  return cameras;
}

Dataset read_easymocap(const fs::path& path, const DatasetOptions& /*options*/,
                       const Limits& limits) {
  if (!fs::exists(path / "intri.yml")) {
    throw DataError((path / "annots.npy").string(), "",
                    "a NumPy file of Python objects, which runs code when it is read",
                    "intri.yml and extri.yml (EasyMocap writes them from the same calibration)");
  }
  Dataset dataset;
  dataset.root = path;
  dataset.world_convention = kEasyMocapWorld;
  dataset.cameras = parse_easymocap_cameras(
      read_file_text(path / "intri.yml", limits.text_file_bytes),
      read_file_text(path / "extri.yml", limits.text_file_bytes), path.string(), limits);
  dataset.frames.resize(dataset.cameras.size());
  for (const char* base : {"images", "videos"}) {
    dataset = with_pictures(std::move(dataset), &CameraFrames::images, path / base, limits);
  }
  const bool none = std::all_of(dataset.frames.begin(), dataset.frames.end(),
                                [](const CameraFrames& frames) { return frames.images.empty(); });
  for (std::size_t c = 0; none && c < dataset.cameras.size(); ++c) {  // ZJU
    dataset.frames[c].images = numbered_files(path / dataset.cameras[c].id, {}, limits);
  }
  for (const std::string& name : camera_names(path, limits)) {
    if (name == "mask_cihp") {
      dataset = with_pictures(std::move(dataset), &CameraFrames::labels, path / name, limits);
      dataset.info.label_taxonomy = "cihp";
    } else if (name.starts_with("mask")) {
      dataset = with_pictures(std::move(dataset), &CameraFrames::masks, path / name, limits);
    }
  }
  dataset.keypoint_shift = 0.5;
  dataset.info.keypoint_schema.clear();
  if (fs::is_directory(path / "annots")) {
    dataset.keypoint_file = KeypointFile::EasyMocap;
    dataset = with_keypoints(std::move(dataset), path / "annots", limits);
  } else {
    dataset = with_keypoints(std::move(dataset), path / "openpose", limits);
  }
  dataset.keypoints3d = numbered_files(path / "keypoints3d", {".json"}, limits);
  return dataset;
}

std::vector<std::string> write_easymocap(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost;
  const std::vector<Camera> cameras = cameras_in(source, kEasyMocapWorld);
  std::string intrinsics = names_yaml(cameras);
  std::string extrinsics = names_yaml(cameras);
  int number = 0;
  for (const int frame : source.sequence.frame_ids) {
    // Frames are numbered from 0 there.
    const std::string name = frame_name(number++);
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const auto camera = static_cast<Index>(c);
      const std::string& id = cameras[c].id;
      const std::string extension =
          write_picture(source, camera, frame, out / "images" / id / name);
      write_mask(source, camera, frame, out / "mask" / id / (name + ".png"));
      if (source.dataset().frames[c].keypoints.contains(frame)) {
        make_private_directory(out / "annots" / id);
        write_file_atomically(out / "annots" / id / (name + ".json"),
                              annotation(source, camera, frame, name + extension));
      }
    }
    if (source.dataset().keypoints3d.contains(frame)) {
      lost.emplace_back("keypoints in space are left out");
    }
  }
  for (const Camera& camera : cameras) {
    OpencvCamera opencv = opencv_of(camera);
    const std::array<double, 5> d = five_distortion(camera, lost);
    intrinsics += opencv_yaml_matrix("K_" + camera.id, opencv.matrix);
    intrinsics += opencv_yaml_matrix("dist_" + camera.id,
                                     Eigen::Map<const Eigen::Matrix<double, 1, 5>>(d.data()));
    intrinsics += "H_" + camera.id + ": " + std::to_string(camera.height) + "\n";
    intrinsics += "W_" + camera.id + ": " + std::to_string(camera.width) + "\n";
    extrinsics += opencv_yaml_matrix("R_" + camera.id, vector_of_rotation(opencv.rotation));
    extrinsics += opencv_yaml_matrix("Rot_" + camera.id, opencv.rotation);
    extrinsics += opencv_yaml_matrix("T_" + camera.id, opencv.translation);
    if (camera.gain != Eigen::Vector3d::Ones()) {
      lost.emplace_back("gains of the cameras are left out");
    }
  }
  if (!source.sequence.frame_ids.empty() && source.sequence.frame_ids.front() != 0) {
    lost.emplace_back("frame numbers begin at 0 in each sequence");
  }
  lost.emplace_back("the frame rate is left out; labels become masks of the person");
  write_file_atomically(out / "intri.yml", intrinsics);
  write_file_atomically(out / "extri.yml", extrinsics);
  return lost;
}

}  // namespace atelier
