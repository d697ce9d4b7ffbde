// CMU Panoptic, nerfstudio, DNA-Rendering: layouts whose calibrations are JSON or HDF5.
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "capture/layout_source.h"
#include "capture/truth_archive.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/io/file_bytes.h"
#include "core/tensor.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

nlohmann::ordered_json rows_of(const Eigen::MatrixXd& matrix) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (Index i = 0; i < matrix.rows(); ++i) {
    nlohmann::ordered_json row = nlohmann::ordered_json::array();
    for (Index j = 0; j < matrix.cols(); ++j) {
      row.push_back(matrix(i, j));
    }
    rows.push_back(row);
  }
  return rows;
}

/// OpenCV's matrix: the first pixel's centre at (0, 0).
Eigen::Matrix3d opencv_matrix(const Camera& camera) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = camera.fx;
  k(1, 1) = camera.fy;
  k(0, 2) = camera.cx - 0.5;
  k(1, 2) = camera.cy - 0.5;
  return k;
}

std::vector<double> five(const Camera& camera) {
  const auto& d = camera.distortion;
  return camera.distortion_model == Distortion::Brown
             ? std::vector<double>{d[0], d[1], d[2], d[3], d[4]}
             : std::vector<double>(5, 0.0);
}

std::string two_digits(std::size_t i) {
  return (i < 10 ? "0" : "") + std::to_string(i);
}

Tensor bytes_tensor(const fs::path& path) {
  const std::vector<std::byte> bytes = read_file_bytes(path, Limits{}.image_file_bytes);
  Tensor tensor;
  tensor.type = ElementType::UInt8;
  tensor.shape = {static_cast<std::int64_t>(bytes.size())};
  tensor.data = bytes;
  return tensor;
}

/// Lenses that five coefficients do not describe.
std::vector<std::string> lost_lenses(const LayoutSource& source) {
  for (const Camera& camera : source.cameras) {
    const auto& d = camera.distortion;
    if (camera.distortion_model == Distortion::Fisheye) {
      return {"fisheye distortion is left out: the layout has none"};
    }
    if (d[5] != 0 || d[6] != 0 || d[7] != 0) {
      return {"k4 to k6 of the rational distortion are left out"};
    }
  }
  return {};
}

}  // namespace

std::vector<std::string> write_panoptic(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = lost_lenses(source);
  nlohmann::ordered_json root;
  root["calibDataSource"] = source.sequence.name;
  root["cameras"] = nlohmann::ordered_json::array();
  for (std::size_t c = 0; c < source.cameras.size(); ++c) {
    const Camera& camera = source.cameras[c];
    const std::string name = "00_" + two_digits(c);
    nlohmann::ordered_json entry;
    entry["name"] = name;
    entry["type"] = "hd";
    entry["resolution"] = {camera.width, camera.height};
    entry["panel"] = 0;
    entry["node"] = c;
    entry["K"] = rows_of(opencv_matrix(camera));
    entry["distCoef"] = five(camera);
    entry["R"] = rows_of(camera.camera_from_world_rotation);
    entry["t"] = rows_of(100 * camera.camera_from_world_translation);  // centimetres
    root["cameras"].push_back(entry);
    for (const int frame : source.sequence.frame_ids) {
      link_file(source.image(camera, frame),
                out / "hdImgs" / name /
                    (name + "_00" + frame_name(frame) + "." + source.info.image_format));
    }
  }
  lost.emplace_back("frame rate, detected keypoints and labels are left out");
  write_file_atomically(out / ("calibration_" + source.sequence.name + ".json"),
                        root.dump(1) + "\n");
  return lost;
}

std::vector<std::string> write_nerfstudio(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost;
  nlohmann::ordered_json root;
  root["frames"] = nlohmann::ordered_json::array();
  // World z up there; camera x right, y up, z back.
  Eigen::Matrix4d z_from_y_up = Eigen::Matrix4d::Identity();
  z_from_y_up.block<2, 2>(1, 1) << 0, -1, 1, 0;
  const Eigen::Vector4d flip(1, -1, -1, 1);
  for (const Camera& camera : source.cameras) {
    Eigen::Matrix4d world_from_camera = Eigen::Matrix4d::Identity();
    world_from_camera.topLeftCorner<3, 3>() = camera.camera_from_world_rotation.transpose();
    world_from_camera.topRightCorner<3, 1>() = camera_center(camera);
    const Eigen::Matrix4d matrix = z_from_y_up * world_from_camera * flip.asDiagonal();
    std::size_t number = 0;
    for (const int frame : source.sequence.frame_ids) {
      const std::string file = camera.id + "_" + frame_name(frame) + "." + source.info.image_format;
      link_file(source.image(camera, frame), out / "images" / file);
      write_mask(source.labels(camera, frame),
                 out / "masks" / (camera.id + "_" + frame_name(frame) + ".png"));
      nlohmann::ordered_json entry;
      entry["file_path"] = "images/" + file;
      if (fs::exists(source.labels(camera, frame))) {
        entry["mask_path"] = "masks/" + camera.id + "_" + frame_name(frame) + ".png";
      }
      entry["camera_model"] =
          camera.distortion_model == Distortion::Fisheye ? "OPENCV_FISHEYE" : "OPENCV";
      entry["w"] = camera.width;
      entry["h"] = camera.height;
      entry["fl_x"] = camera.fx;
      entry["fl_y"] = camera.fy;
      entry["cx"] = camera.cx;
      entry["cy"] = camera.cy;
      const auto& d = camera.distortion;
      if (camera.distortion_model == Distortion::Fisheye) {
        for (std::size_t i = 0; i < 4; ++i) {
          entry["k" + std::to_string(i + 1)] = d[i];
        }
      } else if (camera.distortion_model == Distortion::Brown) {
        entry["k1"] = d[0];
        entry["k2"] = d[1];
        entry["p1"] = d[2];
        entry["p2"] = d[3];
        entry["k3"] = d[4];
        entry["k4"] = d[5];
        if (d[6] != 0 || d[7] != 0) {
          lost.emplace_back("k5 and k6 of the rational distortion are left out");
        }
      }
      entry["transform_matrix"] = rows_of(matrix);
      entry["time"] = static_cast<double>(number++) / source.sequence.fps;
      root["frames"].push_back(entry);
    }
  }
  lost.emplace_back("keypoints and labels are left out (masks of the person are kept)");
  write_file_atomically(out / "transforms.json", root.dump(1) + "\n");
  return lost;
}

std::vector<std::string> write_dna(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = lost_lenses(source);
  Archive images;
  images.schema = "dna.main";
  Archive annotations;
  annotations.schema = "dna.annotations";
  for (std::size_t c = 0; c < source.cameras.size(); ++c) {
    const Camera& camera = source.cameras[c];
    const std::string parameters = "Camera_Parameter/" + two_digits(c);
    annotations.datasets[parameters + "/K"] = tensor_of(RowMatrix(opencv_matrix(camera)));
    annotations.datasets[parameters + "/D"] = tensor_of(five(camera));
    RowMatrix world_from_camera = RowMatrix::Identity(4, 4);
    world_from_camera.topLeftCorner(3, 3) = camera.camera_from_world_rotation.transpose();
    world_from_camera.topRightCorner(3, 1) = camera_center(camera);
    annotations.datasets[parameters + "/RT"] = tensor_of(world_from_camera);
    RowMatrix color = RowMatrix::Zero(3, 3);
    color.diagonal() = camera.gain.cwiseInverse();
    annotations.datasets[parameters + "/Color_Calibration"] = tensor_of(color);
    int number = 0;
    for (const int frame : source.sequence.frame_ids) {
      const std::string place = std::to_string(c) + "/color/" + std::to_string(number);
      images.datasets["Camera_5mp/" + place] = bytes_tensor(source.image(camera, frame));
      if (fs::exists(source.labels(camera, frame))) {
        const fs::path mask = out / ".mask.png";
        write_mask(source.labels(camera, frame), mask);
        annotations.datasets["Mask/" + two_digits(c) + "/mask/" + std::to_string(number)] =
            bytes_tensor(mask);
        fs::remove(mask);
      }
      ++number;
    }
  }
  lost.emplace_back(
      "frame numbers begin at 0 in each sequence; keypoints and labels are left out "
      "(masks of the person are kept)");
  lost.emplace_back("attributes of the groups (actor, number of devices and frames) are left out");
  make_private_directory(out / "main");
  make_private_directory(out / "annotations");
  write_archive(out / "main" / (source.sequence.name + ".smc"), images);
  write_archive(out / "annotations" / (source.sequence.name + "_annots.smc"), annotations);
  return lost;
}

}  // namespace atelier
