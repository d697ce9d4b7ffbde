#include "capture/layouts/camera_toml.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "capture/camera_conventions.h"
#include "capture/layouts/camera_side.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/json_numbers.h"
#include "capture/layouts/qualisys.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/json_place.h"
#include "core/io/toml.h"
#include "core/printable.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

/// Pose2Sim's world has Z up (it turns results to Y up at the end); a Caliscope world has its
/// origin on the board that the user picked, which lies on the floor by its tutorial.
const WorldConvention kZUp = {1, "z"};
/// anipose does not say where its world comes from.
const WorldConvention kNoUp = {1, ""};
/// FreeMoCap's files are anipose's, in millimetres: the board's squares are measured in them.
const WorldConvention kFreeMoCap = {0.001, ""};
constexpr const char* kFreeMoCapEnd = "_camera_calibration.toml";

Eigen::Matrix3d matrix_of_rows(const JsonPlace& place) {
  Eigen::Matrix3d matrix;
  const std::vector<JsonPlace> rows = place.items();
  if (rows.size() != 3) {
    place.fail(std::to_string(rows.size()) + " rows", "3");
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const std::vector<double> row = rows[i].numbers();
    if (row.size() != 3) {
      rows[i].fail(counted(static_cast<std::int64_t>(row.size()), "number"), "3");
    }
    matrix.row(static_cast<Index>(i)) << row[0], row[1], row[2];
  }
  return matrix;
}

Eigen::Matrix3d rotation_of(const JsonPlace& place) {
  if (place.size() > 0 && place.value().front().is_array()) {
    return matrix_of_rows(place);
  }
  const std::vector<double> vector = place.numbers();
  if (vector.size() != 3) {
    place.fail(counted(static_cast<std::int64_t>(vector.size()), "number"),
               "a rotation vector or a 3 x 3 rotation matrix");
  }
  return rotation_of_vector({vector[0], vector[1], vector[2]});
}

int pixels(const JsonPlace& place, double value) {
  if (!is_camera_side(value)) {
    place.fail(number_text(value), "pixels, " + camera_side_range());
  }
  return saturating_cast<int>(value);
}

bool is_camera(const nlohmann::json& value) {
  return value.is_object() && value.contains("size") &&
         (value.contains("matrix") || value.contains("rotation") || value.contains("distortions"));
}

/// One calibration file, "" if there is none: `path` itself, or the first of the folder's.
fs::path first_existing(const std::vector<fs::path>& candidates) {
  for (const fs::path& path : candidates) {
    if (fs::is_regular_file(path)) {
      return path;
    }
  }
  return {};
}

fs::path pose2sim_file(const fs::path& path) {
  if (fs::is_regular_file(path)) {
    const std::string name = path.filename().string();
    return name.starts_with("Calib") && name.ends_with(".toml") ? path : fs::path();
  }
  std::vector<fs::path> candidates;
  for (const fs::path& folder : {path / "calibration", path}) {
    for (const fs::path& file : files_ending(folder, ".toml")) {
      if (file.filename().string().starts_with("Calib")) {
        candidates.push_back(file);
      }
    }
  }
  return first_existing(candidates);
}

bool holds_cameras(const fs::path& file, const char* key) {
  if (file.empty()) {
    return false;
  }
  try {
    const nlohmann::json parsed =
        parse_python_toml(read_file_text(file, Limits{}.text_file_bytes), file.string());
    return parsed.contains(key);
  } catch (const DataError&) {
    return false;  // whatever it is, it is not told by this
  }
}

fs::path caliscope_file(const fs::path& path) {
  if (fs::is_regular_file(path)) {
    return path.filename() == "camera_array.toml" ? path : fs::path();
  }
  fs::path file = first_existing({path / "camera_array.toml"});
  if (!file.empty()) {
    return file;
  }
  const fs::path config = first_existing({path / "config.toml"});
  return holds_cameras(config, "cam_0") || holds_cameras(config, "cam_1") ? config : fs::path();
}

bool is_freemocap(const fs::path& file) {
  return file.filename().string().ends_with(kFreeMoCapEnd);
}

fs::path anipose_file(const fs::path& path) {
  if (fs::is_regular_file(path)) {
    return path.filename() == "calibration.toml" || is_freemocap(path) ? path : fs::path();
  }
  std::vector<fs::path> candidates = {path / "calibration.toml",
                                      path / "calibration" / "calibration.toml"};
  const std::vector<fs::path> recordings = files_ending(path, kFreeMoCapEnd);
  candidates.insert(candidates.end(), recordings.begin(), recordings.end());
  return first_existing(candidates);
}

std::string evidence_of(const fs::path& file) {
  return file.empty() ? "" : file.filename().string();
}

/// The folder that the images lie in: where the calibration is, or one above its folder
/// calibration/.
fs::path root_of(const fs::path& file) {
  const fs::path folder = file.parent_path();
  return folder.filename() == "calibration" ? folder.parent_path() : folder;
}

Dataset read_file(const fs::path& file, const WorldConvention& world, const Limits& limits) {
  if (file.empty()) {
    throw DataError("", "", "no TOML of cameras", "the calibration that the layout has");
  }
  Dataset dataset;
  dataset.root = root_of(file);
  if (dataset.root.empty()) {
    dataset.root = ".";
  }
  CameraToml toml =
      parse_camera_toml(read_file_text(file, limits.text_file_bytes), file.string(), limits);
  dataset.cameras = std::move(toml.cameras);
  dataset.findings = std::move(toml.findings);
  dataset.frames.resize(dataset.cameras.size());
  dataset.world_convention = world;
  return with_pose2sim_frames(std::move(dataset), limits);
}

/// QTM counts in sixty-fourths of a pixel; some converters also divide the distortion by 64, which
/// has no unit. Found where the QTM file lies beside.
void compare_with_qualisys(Dataset& dataset, const fs::path& toml, const Limits& limits) {
  const std::vector<fs::path> files = files_ending(toml.parent_path(), ".qca.txt", limits);
  if (files.empty()) {
    return;
  }
  std::vector<Camera> original;
  try {
    original = parse_qualisys(read_file_text(files.front(), limits.text_file_bytes),
                              files.front().string(), limits)
                   .cameras;
  } catch (const DataError& error) {
    dataset.findings.push_back({Severity::Note, "qualisys-unread", error.file, error.what(),
                                "nothing; it was only read to compare"});
    return;
  }
  if (original.size() != dataset.cameras.size()) {
    return;
  }
  constexpr double kSubPixels = 64;
  std::size_t scaled = 0;
  for (std::size_t c = 0; c < original.size(); ++c) {
    const double theirs = dataset.cameras[c].distortion[0];
    const double k1 = original[c].distortion[0];
    constexpr double kRounding = 1e-6;
    scaled += k1 != 0 && std::abs(kSubPixels * theirs - k1) < kRounding * std::abs(k1) ? 1 : 0;
  }
  if (scaled > 0 && scaled == original.size()) {
    dataset.findings.push_back(
        {Severity::Error, "distortion-scaled", toml.string(),
         "every distortion coefficient is a 64th of those in " + files.front().filename().string() +
             ": the unit of QTM's pixels was taken off numbers that have none (k1 is " +
             number_text(dataset.cameras.front().distortion[0]) + " instead of " +
             number_text(original.front().distortion[0]) + ")",
         "read the QTM file itself", "--capture.layout qualisys"});
  }
}

/// "BODY_25B" and so on of a Pose2Sim Config.toml; "" if it does not say.
std::string schema_of_config(const fs::path& root, const Limits& limits) {
  static const std::map<std::string, std::string> known = {{"BODY_25B", "body_25b"},
                                                           {"BODY_25", "body_25"},
                                                           {"COCO", "coco_18"},
                                                           {"COCO_17", "coco_17"},
                                                           {"Body", "coco_17"},
                                                           {"HALPE_26", "halpe_26"},
                                                           {"Body_with_feet", "halpe_26"},
                                                           {"COCO_133", "coco_wholebody"},
                                                           {"Whole_body", "coco_wholebody"}};
  const fs::path file = root / "Config.toml";
  if (!fs::is_regular_file(file)) {
    return "";
  }
  const nlohmann::json config = read_toml(file, limits);
  for (const auto& [table, key] :
       {std::pair{"pose", "pose_model"}, {"pose-2d", "openpose_model"}}) {
    const auto found = config.find(table);
    if (found != config.end() && found->is_object() && found->contains(key) &&
        (*found)[key].is_string()) {
      const auto name = known.find((*found)[key].get<std::string>());
      if (name != known.end()) {
        return name->second;
      }
    }
  }
  return "";
}

std::string camera_table(const Camera& camera, bool as_matrix, std::vector<std::string>& lost) {
  const OpencvCamera opencv = opencv_of(camera);
  const auto row = [](const Eigen::RowVector3d& values) {
    return "[" + number_text(values[0]) + ", " + number_text(values[1]) + ", " +
           number_text(values[2]) + "]";
  };
  const auto rows = [&](const Eigen::Matrix3d& matrix) {
    return "[" + row(matrix.row(0)) + ", " + row(matrix.row(1)) + ", " + row(matrix.row(2)) + "]";
  };
  std::string distortion;
  std::vector<double> values = opencv.distortion;
  if (!opencv.fisheye) {
    const std::array<double, 5> d = five_distortion(camera, lost);
    values.assign(d.begin(), d.end());
  }
  for (const double value : values) {
    distortion += (distortion.empty() ? "" : ", ") + number_text(value);
  }
  if (camera.gain != Eigen::Vector3d::Ones()) {
    lost.emplace_back("gains of the cameras are left out");
  }
  return "name = " + nlohmann::json(camera.id).dump() + "\nsize = [" +
         std::to_string(camera.width) + ", " + std::to_string(camera.height) +
         "]\nmatrix = " + rows(opencv.matrix) + "\ndistortions = [" + distortion +
         "]\nrotation = " +
         (as_matrix ? rows(opencv.rotation)
                    : row(vector_of_rotation(opencv.rotation).transpose())) +
         "\ntranslation = " + row(opencv.translation.transpose()) +
         "\nfisheye = " + (opencv.fisheye ? "true" : "false") + "\n\n";
}

/// Images to images/<camera>/, detections to pose/<camera>_json/.
void write_frames(const LayoutSource& source, const fs::path& out) {
  for (std::size_t c = 0; c < source.cameras().size(); ++c) {
    const std::string& id = source.cameras()[c].id;
    for (const int frame : source.sequence.frame_ids) {
      const auto camera = static_cast<Index>(c);
      write_picture(source, camera, frame, out / "images" / id / frame_name(frame));
      write_keypoints(source, camera, frame,
                      out / "pose" / (id + "_json") / (id + "_" + frame_name(frame) + ".json"),
                      0.5);
    }
  }
}

const char* const kLost = "frame rate, masks and labels are left out (detections are kept)";

}  // namespace

CameraToml parse_camera_toml(std::string_view text, const std::string& file, const Limits& limits) {
  const nlohmann::json parsed = parse_python_toml(text, file, limits);
  const JsonPlace root(parsed, file);
  // Caliscope's newer files have all cameras below one table.
  const std::optional<JsonPlace> below = root.find("cameras");
  const JsonPlace& tables = below && below->value().is_object() ? *below : root;
  CameraToml result;
  for (const auto& [key, value] : tables.value().items()) {
    if (!is_camera(value)) {
      continue;
    }
    if (static_cast<std::int64_t>(result.cameras.size()) >= limits.cameras) {
      root.fail("more than " + std::to_string(limits.cameras) + " cameras", "fewer");
    }
    const JsonPlace table = tables.at(key);
    OpencvCamera camera;
    camera.id = key;
    if (table.has("name")) {
      camera.id = table.at("name").text();
    }
    const auto leave_out = [&](const std::string& why) {
      result.findings.push_back(camera_left_out(camera.id, why));
    };
    if (table.boolean_or("ignore", false)) {
      leave_out("its calibration says to ignore it");
      continue;
    }
    // Caliscope writes "null" (in a text) for what it has not found.
    const auto lacks = [&](const char* name) {
      const std::optional<JsonPlace> place = table.find(name);
      return !place || is_unsaid(*place);
    };
    if (lacks("rotation") || lacks("translation")) {
      leave_out("it has no pose");
      continue;
    }
    if (lacks("matrix") || lacks("size")) {
      leave_out("it has no intrinsics");
      continue;
    }
    const JsonPlace size = table.at("size");
    const std::vector<double> sides = size.numbers();
    if (sides.size() != 2) {
      size.fail(counted(static_cast<std::int64_t>(sides.size()), "number"), "width and height");
    }
    camera.width = pixels(size, sides[0]);
    camera.height = pixels(size, sides[1]);
    camera.matrix = matrix_of_rows(table.at("matrix"));
    if (!lacks("distortions")) {
      camera.distortion = table.at("distortions").numbers();
    }
    camera.fisheye = table.boolean_or("fisheye", false);
    camera.rotation = rotation_of(table.at("rotation"));
    const JsonPlace translation = table.at("translation");
    const std::vector<double> t = translation.numbers();
    if (t.size() != 3) {
      translation.fail(counted(static_cast<std::int64_t>(t.size()), "number"), "3");
    }
    camera.translation = {t[0], t[1], t[2]};
    result.cameras.push_back(camera_of(camera, file));
  }
  if (result.cameras.empty()) {
    const std::size_t without = result.findings.size();
    root.fail(without > 0 ? "no camera with a pose and intrinsics (" + std::to_string(without) +
                                " have none or are to be ignored)"
                          : "no camera",
              "tables with size, matrix, distortions, rotation, translation");
  }
  return result;
}

Dataset with_pose2sim_frames(Dataset dataset, const Limits& limits) {
  const fs::path root = dataset.root;
  dataset.keypoint_shift = 0.5;
  dataset.info.keypoint_schema.clear();
  for (const char* base : {"images", "videos", "recordings", "videos-raw", "synchronized_videos"}) {
    dataset = with_pictures(std::move(dataset), &CameraFrames::images, root / base, limits);
  }
  // pose/, in older projects pose-2d/.
  for (const std::string& name : camera_names(root, limits)) {
    if (name.starts_with("pose") && !name.starts_with("pose-3d")) {
      dataset = with_keypoints(std::move(dataset), root / name, limits);
    }
  }
  return dataset;
}

std::string recognize_pose2sim(const fs::path& path) {
  return evidence_of(pose2sim_file(path));
}
std::string recognize_caliscope(const fs::path& path) {
  return evidence_of(caliscope_file(path));
}
std::string recognize_anipose(const fs::path& path) {
  return evidence_of(anipose_file(path));
}

Dataset read_pose2sim(const fs::path& path, const DatasetOptions& /*options*/,
                      const Limits& limits) {
  const fs::path file = pose2sim_file(path);
  Dataset dataset = read_file(file, kZUp, limits);
  compare_with_qualisys(dataset, file, limits);
  dataset.info.keypoint_schema = schema_of_config(dataset.root, limits);
  return dataset;
}

Dataset read_caliscope(const fs::path& path, const DatasetOptions& /*options*/,
                       const Limits& limits) {
  return read_file(caliscope_file(path), kZUp, limits);
}

Dataset read_anipose(const fs::path& path, const DatasetOptions& /*options*/,
                     const Limits& limits) {
  const fs::path file = anipose_file(path);
  return read_file(file, is_freemocap(file) ? kFreeMoCap : kNoUp, limits);
}

std::vector<std::string> write_pose2sim(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {kLost};
  write_frames(source, out);
  std::string text;
  for (const Camera& camera : cameras_in(source, kZUp)) {
    text += "[" + nlohmann::json(camera.id).dump() + "]\n" + camera_table(camera, false, lost);
  }
  make_private_directory(out / "calibration");
  write_file_atomically(out / "calibration" / "Calib.toml",
                        text + "[metadata]\nadjusted = false\nerror = 0.0\n");
  return lost;
}

std::vector<std::string> write_caliscope(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {kLost};
  write_frames(source, out);
  std::string text;
  int number = 0;
  for (const Camera& camera : cameras_in(source, kZUp)) {
    text += "[cameras." + std::to_string(number) + "]\ncam_id = " + std::to_string(number) +
            "\nrotation_count = 0\n" + camera_table(camera, true, lost);
    ++number;
  }
  write_file_atomically(out / "camera_array.toml", text);
  return lost;
}

std::vector<std::string> write_anipose(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {kLost};
  write_frames(source, out);
  std::string text;
  int number = 0;
  for (const Camera& camera : source.cameras()) {
    text += "[cam_" + std::to_string(number++) + "]\n" + camera_table(camera, false, lost);
  }
  write_file_atomically(out / "calibration.toml",
                        text + "[metadata]\nadjusted = false\nerror = 0.0\n");
  return lost;
}

}  // namespace atelier
