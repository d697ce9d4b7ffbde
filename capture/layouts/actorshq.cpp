#include "capture/layouts/actorshq.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>

#include "capture/camera_conventions.h"
#include "capture/layouts/camera_side.h"
#include "capture/layouts/frame_files.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/text_scanner.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const WorldConvention kActorsHqWorld = {1, ""};
const WorldConvention kActorsHqWritten = {1, "y"};

/// The folder of one resolution: the one named, else the finest that is there.
fs::path scale_folder(const fs::path& path) {
  for (const fs::path& folder : {path, path / "1x", path / "2x", path / "4x"}) {
    if (fs::is_regular_file(folder / "calibration.csv")) {
      return folder;
    }
  }
  return {};
}

std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells;
  for (;;) {
    const std::size_t comma = std::min(line.find(','), line.size());
    std::string_view cell = line.substr(0, comma);
    while (!cell.empty() && cell.front() == ' ') {
      cell.remove_prefix(1);
    }
    while (!cell.empty() && cell.back() == ' ') {
      cell.remove_suffix(1);
    }
    cells.emplace_back(cell);
    if (comma == line.size()) {
      return cells;
    }
    line.remove_prefix(comma + 1);
  }
}

/// An empty cell, or NaN as programs write it.
bool is_unsaid_cell(const std::string& cell) {
  return cell.empty() || cell == "nan" || cell == "NaN" || cell == "NAN";
}

}  // namespace

std::string recognize_actorshq(const fs::path& path) {
  const fs::path folder = scale_folder(path);
  return folder.empty() ? "" : "calibration.csv";
}

std::vector<Camera> parse_actorshq_cameras(std::string_view text, const std::string& file,
                                           const Limits& limits) {
  TextScanner scanner(text, file, limits.line_bytes);
  std::map<std::string, std::size_t> columns;
  if (scanner.next_line()) {
    const std::vector<std::string> names = cells_of(scanner.rest());
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (!columns.emplace(names[i], i).second) {
        scanner.fail("two columns " + in_quotes(names[i]), "each once");
      }
    }
  }
  for (const char* name :
       {"name", "w", "h", "rx", "ry", "rz", "tx", "ty", "tz", "fx", "fy", "px", "py"}) {
    if (!columns.contains(name)) {
      scanner.fail("no column '" + std::string(name) + "'",
                   "name,w,h,rx,ry,rz,tx,ty,tz,fx,fy,px,py");
    }
  }
  std::vector<Camera> cameras;
  while (scanner.next_line()) {
    const std::vector<std::string> cells = cells_of(scanner.rest());
    if (cells.size() == 1 && cells.front().empty()) {
      continue;
    }
    if (cells.size() != columns.size()) {
      scanner.fail(std::to_string(cells.size()) + " values",
                   std::to_string(columns.size()) + ", one for each column");
    }
    const auto number = [&](const char* column) {
      const std::string& cell = cells[columns.at(column)];
      double value = 0;
      if (!parse_number(cell, value)) {
        scanner.fail(no_number(cell), std::string(column) + ", a finite number");
      }
      return value;
    };
    const auto pixels = [&](const char* column) {
      const double value = number(column);
      if (!is_camera_side(value)) {
        scanner.fail(in_quotes(cells[columns.at(column)]), "pixels, a whole number");
      }
      return saturating_cast<int>(value);
    };
    Camera camera;
    camera.id = cells[columns.at("name")];
    camera.width = pixels("w");
    camera.height = pixels("h");
    camera.fx = number("fx") * camera.width;
    camera.fy = number("fy") * camera.height;
    camera.cx = number("px") * camera.width;
    camera.cy = number("py") * camera.height;
    int slot = 0;
    for (const char* name : {"k1", "k2", "k3"}) {
      const double value = columns.contains(name) ? number(name) : 0;
      camera.distortion[static_cast<std::size_t>(slot == 2 ? 4 : slot)] = value;
      camera.distortion_model = value != 0 ? Distortion::Brown : camera.distortion_model;
      ++slot;
    }
    constexpr std::array kPose = {"rx", "ry", "rz", "tx", "ty", "tz"};
    if (std::any_of(kPose.begin(), kPose.end(), [&](const char* column) {
          return is_unsaid_cell(cells[columns.at(column)]);
        })) {
      camera.camera_from_world_rotation.setZero();  // open_dataset leaves it out
      cameras.push_back(camera);
      continue;
    }
    const Eigen::Matrix3d world_from_camera =
        rotation_of_vector({number("rx"), number("ry"), number("rz")});
    camera.camera_from_world_rotation = world_from_camera.transpose();
    camera.camera_from_world_translation =
        -(camera.camera_from_world_rotation *
          Eigen::Vector3d(number("tx"), number("ty"), number("tz")));
    check_numbers(camera, file);
    cameras.push_back(camera);
    if (static_cast<std::int64_t>(cameras.size()) > limits.cameras) {
      scanner.fail("more than " + std::to_string(limits.cameras) + " cameras", "fewer");
    }
  }
  if (cameras.empty()) {
    scanner.fail("no camera", "a line for each");
  }
  return cameras;
}

Dataset read_actorshq(const fs::path& path, const DatasetOptions& /*options*/,
                      const Limits& limits) {
  const fs::path folder = scale_folder(path);
  if (folder.empty()) {
    throw DataError(path.string(), "", "no calibration.csv", "the one of 1x/, 2x/ or 4x/");
  }
  const fs::path file = folder / "calibration.csv";
  Dataset dataset;
  dataset.root = folder;
  dataset.cameras =
      parse_actorshq_cameras(read_file_text(file, limits.text_file_bytes), file.string(), limits);
  dataset.frames.resize(dataset.cameras.size());
  dataset.world_convention = kActorsHqWorld;
  dataset.info.keypoint_schema.clear();
  dataset = with_pictures(std::move(dataset), &CameraFrames::images, folder / "rgbs", limits);
  dataset = with_pictures(std::move(dataset), &CameraFrames::masks, folder / "masks", limits);
  return dataset;
}

std::vector<std::string> write_actorshq(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {
      "frame rate, keypoints and labels are left out (masks of the person are kept)",
      "the background is not removed", "cameras are called Cam001, Cam002, ..."};
  std::string csv = "name,w,h,rx,ry,rz,tx,ty,tz,fx,fy,px,py\n";
  const fs::path scale = out / "1x";
  make_private_directory(scale);
  const std::vector<Camera> cameras = cameras_in(source, kActorsHqWritten);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    if (camera.gain != Eigen::Vector3d::Ones()) {
      lost.emplace_back("gains of the cameras are left out");
    }
    if (camera.distortion_model != Distortion::None) {
      lost.push_back(lens_left_out(camera));
    }
    char name[24];
    std::snprintf(name, sizeof(name), "Cam%03d", static_cast<int>(c + 1));
    const Eigen::Vector3d r = vector_of_rotation(camera.camera_from_world_rotation.transpose());
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
      const auto index = static_cast<Index>(c);
      const std::string stem = std::string(name) + "_";
      write_picture(source, index, frame,
                    scale / "rgbs" / name / (stem + "rgb" + frame_name(frame)));
      write_mask(source, index, frame,
                 scale / "masks" / name / (stem + "mask" + frame_name(frame) + ".png"));
    }
  }
  write_file_atomically(scale / "calibration.csv", csv);
  return lost;
}

}  // namespace atelier
