// EasyMocap, COLMAP, ActorsHQ: layouts whose calibrations are text of their own kind.
#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "capture/layout_source.h"
#include "capture/truth_archive.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/json.h"
#include "core/io/json_place.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

constexpr const char* kFisheyeLost = "fisheye distortion is left out: the layout has none";
constexpr const char* kRationalLost = "k4 to k6 of the rational distortion are left out";
constexpr const char* kGainLost = "gains of the cameras are left out";

/// k1 k2 p1 p2 k3 of a camera; what they leave out goes to `lost`.
std::array<double, 5> five(const Camera& camera, std::vector<std::string>& lost) {
  if (camera.distortion_model == Distortion::Fisheye) {
    lost.emplace_back(kFisheyeLost);
    return {};
  }
  const auto& d = camera.distortion;
  if (camera.distortion_model == Distortion::None) {
    return {};
  }
  if (d[5] != 0 || d[6] != 0 || d[7] != 0) {
    lost.emplace_back(kRationalLost);
  }
  return {d[0], d[1], d[2], d[3], d[4]};
}

void note_gain(const Camera& camera, std::vector<std::string>& lost) {
  if (camera.gain != Eigen::Vector3d::Ones()) {
    lost.emplace_back(kGainLost);
  }
}

std::string matrix_yaml(const std::string& name, const Eigen::MatrixXd& matrix) {
  std::ostringstream out;
  out << name << ": !!opencv-matrix\n   rows: " << matrix.rows() << "\n   cols: " << matrix.cols()
      << "\n   dt: d\n   data: [ ";
  for (Index i = 0; i < matrix.size(); ++i) {
    out << (i > 0 ? ", " : "") << number_text(matrix(i / matrix.cols(), i % matrix.cols()));
  }
  out << " ]\n";
  return out.str();
}

std::string names_yaml(const std::vector<Camera>& cameras) {
  std::string text = "%YAML:1.0\n---\nnames:\n";
  for (const Camera& camera : cameras) {
    text += "   - \"" + camera.id + "\"\n";
  }
  return text;
}

/// EasyMocap's annotation of one image from our keypoints.
std::string annotation(const LayoutSource& source, const Camera& camera, int frame) {
  nlohmann::ordered_json root;
  root["filename"] = camera.id + "/" + frame_name(frame) + "." + source.info.image_format;
  root["height"] = camera.height;
  root["width"] = camera.width;
  root["annots"] = nlohmann::ordered_json::array();
  const fs::path path = source.keypoints(camera, frame);
  if (fs::exists(path)) {
    const nlohmann::json parsed = read_json(path);
    int id = 0;
    for (const JsonPlace& person : JsonPlace(parsed, path.string()).items("people")) {
      const std::vector<double> values = person.at("pose_keypoints_2d").numbers();
      nlohmann::ordered_json entry;
      entry["personID"] = id++;
      nlohmann::ordered_json points = nlohmann::ordered_json::array();
      double low_x = 1e9;
      double low_y = 1e9;
      double high_x = -1e9;
      double high_y = -1e9;
      double best = 0;
      for (std::size_t i = 0; i + 2 < values.size(); i += 3) {
        // The centre of the first pixel is (0, 0) there; what was not found stays 0, 0, 0.
        const double shift = values[i + 2] > 0 ? 0.5 : 0;
        points.push_back({values[i] - shift, values[i + 1] - shift, values[i + 2]});
        if (values[i + 2] > 0) {
          low_x = std::min(low_x, values[i]);
          low_y = std::min(low_y, values[i + 1]);
          high_x = std::max(high_x, values[i]);
          high_y = std::max(high_y, values[i + 1]);
          best = std::max(best, values[i + 2]);
        }
      }
      if (best > 0) {
        entry["bbox"] = {low_x, low_y, high_x, high_y, best};
      } else {
        entry["bbox"] = {0, 0, camera.width, camera.height, 0};
      }
      entry["keypoints"] = points;
      entry["isKeyframe"] = false;
      root["annots"].push_back(entry);
    }
  }
  return root.dump() + "\n";
}

}  // namespace

std::vector<std::string> write_easymocap(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost;
  std::string intrinsics = names_yaml(source.cameras);
  std::string extrinsics = names_yaml(source.cameras);
  int number = 0;
  for (const int frame : source.sequence.frame_ids) {
    // Frames are numbered from 0 there.
    const std::string name = frame_name(number++);
    for (const Camera& camera : source.cameras) {
      link_file(source.image(camera, frame),
                out / "images" / camera.id / (name + "." + source.info.image_format));
      write_mask(source.labels(camera, frame), out / "mask" / camera.id / (name + ".png"));
      const fs::path annots = out / "annots" / camera.id;
      make_private_directory(annots);
      write_file_atomically(annots / (name + ".json"), annotation(source, camera, frame));
    }
  }
  for (const Camera& camera : source.cameras) {
    const std::array<double, 5> d = five(camera, lost);
    note_gain(camera, lost);
    Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
    k(0, 0) = camera.fx;
    k(1, 1) = camera.fy;
    k(0, 2) = camera.cx - 0.5;
    k(1, 2) = camera.cy - 0.5;
    intrinsics += matrix_yaml("K_" + camera.id, k);
    intrinsics +=
        matrix_yaml("dist_" + camera.id, Eigen::Map<const Eigen::Matrix<double, 1, 5>>(d.data()));
    intrinsics += "H_" + camera.id + ": " + std::to_string(camera.height) + "\n";
    intrinsics += "W_" + camera.id + ": " + std::to_string(camera.width) + "\n";
    const Eigen::AngleAxisd turn(camera.camera_from_world_rotation);
    extrinsics += matrix_yaml("R_" + camera.id, turn.angle() * turn.axis());
    extrinsics += matrix_yaml("Rot_" + camera.id, camera.camera_from_world_rotation);
    extrinsics += matrix_yaml("T_" + camera.id, camera.camera_from_world_translation);
  }
  if (source.sequence.frame_ids.front() != 0) {
    lost.emplace_back("frame numbers begin at 0 in each sequence");
  }
  lost.emplace_back("labels become masks of the person");
  write_file_atomically(out / "intri.yml", intrinsics);
  write_file_atomically(out / "extri.yml", extrinsics);
  return lost;
}

std::vector<std::string> write_colmap(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost;
  std::string cameras =
      "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, "
      "PARAMS[]\n";
  std::string images =
      "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, "
      "CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n";
  int image_id = 0;
  for (std::size_t c = 0; c < source.cameras.size(); ++c) {
    const Camera& camera = source.cameras[c];
    note_gain(camera, lost);
    const auto& d = camera.distortion;
    // Corner origin, as ours.
    std::vector<double> params = {camera.fx, camera.fy, camera.cx, camera.cy};
    std::string model = "PINHOLE";
    if (camera.distortion_model == Distortion::Fisheye) {
      model = "OPENCV_FISHEYE";
      params.insert(params.end(), d.begin(), d.begin() + 4);
    } else if (camera.distortion_model == Distortion::Brown) {
      const bool rational = d[4] != 0 || d[5] != 0 || d[6] != 0 || d[7] != 0;
      model = rational ? "FULL_OPENCV" : "OPENCV";
      params.insert(params.end(), d.begin(), d.begin() + (rational ? 8 : 4));
    }
    cameras += std::to_string(c + 1) + " " + model + " " + std::to_string(camera.width) + " " +
               std::to_string(camera.height);
    for (const double value : params) {
      cameras += " " + number_text(value);
    }
    cameras += "\n";
    Eigen::Quaterniond q(camera.camera_from_world_rotation);
    q.normalize();
    for (const int frame : source.sequence.frame_ids) {
      const std::string name = camera.id + "/" + frame_name(frame) + "." + source.info.image_format;
      link_file(source.image(camera, frame), out / "images" / name);
      write_mask(source.labels(camera, frame), out / "masks" / (name + ".png"));
      images += std::to_string(++image_id);
      for (const double value :
           {q.w(), q.x(), q.y(), q.z(), camera.camera_from_world_translation.x(),
            camera.camera_from_world_translation.y(), camera.camera_from_world_translation.z()}) {
        images += " " + number_text(value);
      }
      images += " " + std::to_string(c + 1) + " " + name + "\n\n";
    }
  }
  lost.emplace_back("frame rate, keypoints and labels are left out (masks of the person are kept)");
  const fs::path sparse = out / "sparse" / "0";
  make_private_directory(sparse);
  write_file_atomically(sparse / "points3D.txt", "# 3D point list: none\n");
  write_file_atomically(sparse / "images.txt", images);
  write_file_atomically(sparse / "cameras.txt", cameras);
  return lost;
}

std::vector<std::string> write_actorshq(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost;
  std::string csv = "name,w,h,rx,ry,rz,tx,ty,tz,fx,fy,px,py\n";
  const fs::path scale = out / "1x";
  for (std::size_t c = 0; c < source.cameras.size(); ++c) {
    const Camera& camera = source.cameras[c];
    note_gain(camera, lost);
    if (camera.distortion_model != Distortion::None) {
      lost.emplace_back(
          "lens distortion is left out: the layout has none, and images are as taken");
    }
    char name[24];
    std::snprintf(name, sizeof(name), "Cam%03d", static_cast<int>(c + 1));
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(camera.camera_from_world_rotation.transpose()));
    const Eigen::Vector3d r = turn.angle() * turn.axis();
    const Eigen::Vector3d t = camera_center(camera);
    csv += std::string(name) + "," + std::to_string(camera.width) + "," +
           std::to_string(camera.height);
    for (const double value :
         {r.x(), r.y(), r.z(), t.x(), t.y(), t.z(), camera.fx / camera.width,
          camera.fy / camera.height, camera.cx / camera.width, camera.cy / camera.height}) {
      csv += "," + number_text(value);
    }
    csv += "\n";
    for (const int frame : source.sequence.frame_ids) {
      const std::string stem = std::string(name) + "_";
      link_file(source.image(camera, frame),
                scale / "rgbs" / name /
                    (stem + "rgb" + frame_name(frame) + "." + source.info.image_format));
      write_mask(source.labels(camera, frame),
                 scale / "masks" / name / (stem + "mask" + frame_name(frame) + ".png"));
    }
  }
  lost.emplace_back("frame rate, keypoints and labels are left out (masks of the person are kept)");
  lost.emplace_back("the background is not removed");
  write_file_atomically(scale / "calibration.csv", csv);
  return lost;
}

}  // namespace atelier
