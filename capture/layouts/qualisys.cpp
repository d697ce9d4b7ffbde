#include "capture/layouts/qualisys.h"

#include <algorithm>
#include <cmath>

#include "capture/camera_conventions.h"
#include "capture/layouts/camera_side.h"
#include "capture/layouts/camera_toml.h"
#include "capture/layouts/frame_files.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/text_scanner.h"
#include "core/io/xml_elements.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const WorldConvention kQualisysWorld = {0.001, "z"};
constexpr double kSubPixels = 64;  ///< QTM's units in a pixel

/// Turns QTM's camera (x right, y up, z back) to ours.
const Eigen::DiagonalMatrix<double, 3> kOurAxes(1, -1, -1);

double number_of(const XmlElement& element, const std::string& key, const std::string& file) {
  const auto found = element.attributes.find(key);
  double value = 0;
  if (found == element.attributes.end() || !parse_number(found->second, value)) {
    throw DataError(file, "line " + std::to_string(element.line),
                    "<" + element.name + "> " + key + " = " +
                        (found == element.attributes.end() ? "nothing" : no_number(found->second)),
                    "a finite number");
  }
  return value;
}

fs::path qualisys_calibration(const fs::path& path) {
  if (fs::is_regular_file(path)) {
    return path.filename().string().ends_with(".qca.txt") ? path : fs::path();
  }
  for (const fs::path& folder : {path, path / "calibration"}) {
    const std::vector<fs::path> files = files_ending(folder, ".qca.txt");
    if (!files.empty()) {
      return files.front();
    }
  }
  return {};
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
  }
  return result;
}

}  // namespace

std::string recognize_qualisys(const fs::path& path) {
  const fs::path file = qualisys_calibration(path);
  return file.empty() ? "" : file.filename().string();
}

QualisysRig parse_qualisys(std::string_view text, const std::string& file, const Limits& limits) {
  QualisysRig rig;
  std::vector<Camera>& cameras = rig.cameras;
  OpencvCamera camera;
  int parts = -1;  // of the camera that is being read: fov_video 1, transform 2, intrinsic 4
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();
  const auto finish = [&] {
    if (parts == -1) {
      return;
    }
    constexpr int kAll = 7;
    constexpr int kPose = 2;
    if (parts == kAll - kPose) {  // open_dataset leaves it out
      camera.rotation.setZero();
    } else if (parts != kAll) {
      throw DataError(file, "camera '" + camera.id + "'", "not all of its parts",
                      "fov_video, transform and intrinsic, each once");
    }
    camera.matrix(0, 2) -= corner.x();
    camera.matrix(1, 2) -= corner.y();
    cameras.push_back(camera_of(camera, file));
  };
  const auto take = [&](const XmlElement& element, int part) {
    if (parts < 0 || (parts & part) != 0) {
      throw DataError(file, "line " + std::to_string(element.line),
                      "<" + element.name + "> outside of a camera or a second time",
                      "once in each camera");
    }
    parts |= part;
  };
  for (const XmlElement& element : parse_xml_elements(text, file, limits)) {
    const auto value = [&](const std::string& key) { return number_of(element, key, file); };
    if (element.name == "camera") {
      finish();
      camera = {};
      parts = 0;
      const auto serial = element.attributes.find("serial");
      if (serial == element.attributes.end() || serial->second.empty()) {
        throw DataError(file, "line " + std::to_string(element.line), "a camera without a serial",
                        "serial=\"...\"");
      }
      camera.id = serial->second;
      int rotation = 0;
      if (element.attributes.contains("viewrotation")) {
        const double degrees = value("viewrotation");
        if (degrees != 0 && degrees != 90 && degrees != 180 && degrees != 270) {
          throw DataError(file, "line " + std::to_string(element.line),
                          "viewrotation " + in_quotes(element.attributes.at("viewrotation")),
                          "0, 90, 180 or 270");
        }
        rotation = saturating_cast<int>(degrees);
      }
      rig.view_rotation.push_back(rotation);
      if (static_cast<std::int64_t>(cameras.size()) >= limits.cameras) {
        throw DataError(file, "cameras", "more than " + std::to_string(limits.cameras), "fewer");
      }
    } else if (element.name == "fov_video") {
      take(element, 1);
      corner = {value("left"), value("top")};
      const double width = value("right") - corner.x() + 1;
      const double height = value("bottom") - corner.y() + 1;
      if (!is_camera_side(std::round(width)) || !is_camera_side(std::round(height))) {
        throw DataError(file, "line " + std::to_string(element.line), "a field of view of no size",
                        "left, top, right and bottom in pixels");
      }
      camera.width = saturating_cast<int>(std::round(width));
      camera.height = saturating_cast<int>(std::round(height));
    } else if (element.name == "transform") {
      const bool unsaid =
          std::any_of(element.attributes.begin(), element.attributes.end(),
                      [](const auto& one) { return one.second == "nan" || one.second == "NaN"; });
      if (unsaid) {
        continue;  // a camera without a pose
      }
      take(element, 2);
      Eigen::Matrix3d rows;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          rows(i, j) = value("r" + std::to_string(i + 1) + std::to_string(j + 1));
        }
      }
      camera.rotation = kOurAxes * rows;
      camera.translation = -(camera.rotation * Eigen::Vector3d(value("x"), value("y"), value("z")));
    } else if (element.name == "intrinsic") {
      take(element, 4);
      // One by one: Eigen's comma aborts where a number in the middle is refused.
      camera.matrix(0, 0) = value("focalLengthU") / kSubPixels;
      camera.matrix(1, 1) = value("focalLengthV") / kSubPixels;
      camera.matrix(0, 1) = value("skew") / kSubPixels;
      camera.matrix(0, 2) = value("centerPointU") / kSubPixels;
      camera.matrix(1, 2) = value("centerPointV") / kSubPixels;
      camera.distortion = {value("radialDistortion1"), value("radialDistortion2"),
                           value("tangentalDistortion1"), value("tangentalDistortion2"),
                           value("radialDistortion3")};
    }
  }
  finish();
  if (cameras.empty()) {
    throw DataError(file, "cameras", "none", "<camera serial=...> elements");
  }
  return rig;
}

Dataset read_qualisys(const fs::path& path, const DatasetOptions& /*options*/,
                      const Limits& limits) {
  const fs::path file = qualisys_calibration(path);
  if (file.empty()) {
    throw DataError(path.string(), "", "no *.qca.txt", "a calibration of QTM");
  }
  Dataset dataset;
  dataset.root = file.parent_path().filename() == "calibration" ? file.parent_path().parent_path()
                                                                : file.parent_path();
  QualisysRig rig =
      parse_qualisys(read_file_text(file, limits.text_file_bytes), file.string(), limits);
  dataset.cameras = std::move(rig.cameras);
  dataset.frames.resize(dataset.cameras.size());
  for (std::size_t c = 0; c < dataset.frames.size(); ++c) {
    dataset.frames[c].view_rotation = rig.view_rotation[c];
  }
  dataset.world_convention = kQualisysWorld;
  return with_pose2sim_frames(std::move(dataset), limits);
}

std::vector<std::string> write_qualisys(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {
      "frame rate, masks and labels are left out (detections are kept)"};
  std::string text =
      "<?xml version='1.0' encoding='UTF-8'?>\n<calibration type=\"regular\" "
      "source=\"atelier\">\n  <cameras>\n";
  const std::vector<Camera> cameras = cameras_in(source, kQualisysWorld);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    const OpencvCamera opencv = opencv_of(camera);
    const std::array<double, 5> d = five_distortion(camera, lost);
    const Eigen::Matrix3d rows = kOurAxes * opencv.rotation;
    const Eigen::Vector3d position = camera_center(camera);
    const auto attribute = [](const std::string& name, double value) {
      return " " + name + "=\"" + number_text(value) + "\"";
    };
    text += "    <camera active=\"1\" serial=\"" + escaped(camera.id) +
            "\" viewrotation=\"0\">\n      <fov_video left=\"0\" top=\"0\"" +
            attribute("right", camera.width - 1) + attribute("bottom", camera.height - 1) +
            "/>\n      <transform";
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        text += attribute("r" + std::to_string(i + 1) + std::to_string(j + 1), rows(i, j));
      }
    }
    text += attribute("x", position.x()) + attribute("y", position.y()) +
            attribute("z", position.z()) + "/>\n      <intrinsic" +
            attribute("focalLengthU", kSubPixels * camera.fx) +
            attribute("focalLengthV", kSubPixels * camera.fy) +
            attribute("centerPointU", kSubPixels * opencv.matrix(0, 2)) +
            attribute("centerPointV", kSubPixels * opencv.matrix(1, 2)) + " skew=\"0\"" +
            attribute("radialDistortion1", d[0]) + attribute("radialDistortion2", d[1]) +
            attribute("radialDistortion3", d[4]) + attribute("tangentalDistortion1", d[2]) +
            attribute("tangentalDistortion2", d[3]) + " sensorMinU=\"0\" sensorMinV=\"0\"" +
            attribute("sensorMaxU", kSubPixels * (camera.width - 1)) +
            attribute("sensorMaxV", kSubPixels * (camera.height - 1)) + "/>\n    </camera>\n";
    if (camera.gain != Eigen::Vector3d::Ones()) {
      lost.emplace_back("gains of the cameras are left out");
    }
    for (const int frame : source.sequence.frame_ids) {
      const auto index = static_cast<Index>(c);
      write_picture(source, index, frame, out / "images" / camera.id / frame_name(frame));
      write_keypoints(
          source, index, frame,
          out / "pose" / (camera.id + "_json") / (camera.id + "_" + frame_name(frame) + ".json"),
          0.5);
    }
  }
  write_file_atomically(out / "calibration.qca.txt", text + "  </cameras>\n</calibration>\n");
  return lost;
}

}  // namespace atelier
