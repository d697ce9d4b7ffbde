#include "capture/layouts/goliath.h"

#include <nlohmann/json.hpp>

#include "capture/camera_conventions.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/json_numbers.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/io/zip_archive.h"
#include "core/printable.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const WorldConvention kGoliathWorld = {0.001, ""};
const WorldConvention kGoliathWritten = {0.001, "y"};

fs::path goliath_calibration(const fs::path& path) {
  const fs::path file = fs::is_regular_file(path) ? path : path / "camera_calibration.json";
  return file.filename() == "camera_calibration.json" && fs::is_regular_file(file) ? file
                                                                                   : fs::path();
}

std::string camera_id_of(const JsonPlace& place) {
  return place.value().is_string() ? place.text() : std::to_string(place.integer(0, 1'000'000'000));
}

/// The zips of one kind by camera: cam<ID>.zip.
Dataset with_zips(Dataset dataset, FrameLocations CameraFrames::*kind, const fs::path& base,
                  const Limits& limits) {
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    dataset.frames[c].*kind = camera_pictures(base, "cam" + dataset.cameras[c].id, limits);
  }
  return dataset;
}

}  // namespace

std::string recognize_goliath(const fs::path& path) {
  const fs::path file = goliath_calibration(path);
  return file.empty() ? "" : "camera_calibration.json";
}

std::vector<Camera> parse_goliath_cameras(std::string_view text, const std::string& file,
                                          const Limits& limits) {
  const nlohmann::json parsed = parse_python_json(text, file, limits);
  const std::vector<JsonPlace> items = JsonPlace(parsed, file).at("KRT").items();
  if (static_cast<std::int64_t>(items.size()) > limits.cameras) {
    throw DataError(file, "KRT", std::to_string(items.size()) + " cameras",
                    "at most " + std::to_string(limits.cameras));
  }
  std::vector<Camera> cameras;
  for (const JsonPlace& entry : items) {
    OpencvCamera camera;
    camera.id = camera_id_of(entry.at("cameraId"));
    camera.matrix = matrix3_of(entry.at("K")).transpose();
    const std::optional<JsonPlace> place = entry.find("T");
    // Without a pose every number of it is 0, which leaves the camera out.
    const bool unsaid = !place || is_unsaid(*place);
    const std::vector<double> values = unsaid ? std::vector<double>(12, 0) : all_numbers(*place);
    if (values.size() != 12 && values.size() != 16) {
      place->fail(counted(static_cast<std::int64_t>(values.size()), "number"),
                  "4 x 4 or 4 x 3, transposed");
    }
    // Row r of the file is column r of camera from world.
    const std::size_t columns = values.size() / 4;
    for (std::size_t r = 0; r < 4; ++r) {
      for (std::size_t i = 0; i < 3; ++i) {
        const double value = values[r * columns + i];
        (r < 3 ? camera.rotation(static_cast<Index>(i), static_cast<Index>(r))
               : camera.translation[static_cast<Index>(i)]) = value;
      }
      if (columns == 4 && values[r * columns + 3] != (r == 3 ? 1 : 0)) {
        place->fail("a last column that is not 0 0 0 1", "camera from world, transposed");
      }
    }
    if (const auto distortion = entry.find("distortion")) {
      camera.distortion = distortion->numbers();
    }
    cameras.push_back(camera_of(camera, file));
  }
  return cameras;
}

Dataset read_goliath(const fs::path& path, const DatasetOptions& /*options*/,
                     const Limits& limits) {
  const fs::path file = goliath_calibration(path);
  if (file.empty()) {
    throw DataError(path.string(), "", "no camera_calibration.json", "the file of KRT");
  }
  const fs::path root = file.parent_path();
  Dataset dataset;
  dataset.root = root;
  dataset.cameras =
      parse_goliath_cameras(read_file_text(file, limits.text_file_bytes), file.string(), limits);
  dataset.frames.resize(dataset.cameras.size());
  dataset.world_convention = kGoliathWorld;
  dataset.info.keypoint_schema.clear();
  dataset.info.label_taxonomy = "goliath_28";
  dataset = with_zips(std::move(dataset), &CameraFrames::images, root / "image", limits);
  dataset =
      with_zips(std::move(dataset), &CameraFrames::labels, root / "segmentation_parts", limits);
  dataset = with_pictured_cameras(std::move(dataset));
  const std::string name = root.string();
  const bool minimal = name.find("MinimalBody") != std::string::npos;
  // 30 frames per second were taken; released are 5 (minimal) and 10 (clothed) of them.
  const bool goliath = minimal || name.find("ClothedBody") != std::string::npos;
  dataset.info.sequences.push_back({minimal ? "minimal" : "clothed",
                                    minimal ? "minimal" : "clothed",
                                    goliath ? (minimal ? 5.0 : 10.0) : 0.0,
                                    {}});
  return dataset;
}

std::vector<std::string> write_goliath(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {
      "frame rate, keypoints, masks and labels are left out (its 28 classes are finer "
      "than "
      "ours)"};
  nlohmann::ordered_json root;
  root["KRT"] = nlohmann::ordered_json::array();
  make_private_directory(out / "image");
  const std::vector<Camera> cameras = cameras_in(source, kGoliathWritten);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    const OpencvCamera opencv = opencv_of(camera);
    Eigen::Matrix4d camera_from_world = Eigen::Matrix4d::Identity();
    camera_from_world.topLeftCorner<3, 3>() = opencv.rotation;
    camera_from_world.topRightCorner<3, 1>() = opencv.translation;
    nlohmann::ordered_json entry;
    entry["cameraId"] = camera.id;
    entry["K"] = rows_json(opencv.matrix.transpose());
    entry["T"] = rows_json(camera_from_world.transpose());
    const std::array<double, 5> d = five_distortion(camera, lost);
    if (d[4] != 0) {
      entry["distortion"] = d;
    } else {
      entry["distortion"] = {d[0], d[1], d[2], d[3]};
    }
    root["KRT"].push_back(entry);
    if (camera.gain != Eigen::Vector3d::Ones()) {
      lost.emplace_back("gains of the cameras are left out");
    }
    std::vector<std::pair<std::string, std::vector<std::byte>>> members;
    for (const int frame : source.sequence.frame_ids) {
      if (auto image = source.frames().encoded_image(static_cast<Index>(c), frame)) {
        members.emplace_back("cam" + camera.id + "/" + frame_name(frame) + image->extension,
                             std::move(image->bytes));
      }
    }
    if (!members.empty()) {
      AtomicFile file(out / "image" / ("cam" + camera.id + ".zip"));
      file.write(zip_bytes(members, false));
      file.commit();
    }
  }
  write_file_atomically(out / "camera_calibration.json", root.dump(1) + "\n");
  return lost;
}

}  // namespace atelier
