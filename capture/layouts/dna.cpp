#include "capture/layouts/dna.h"

#include <algorithm>
#include <optional>
#include <span>

#include "capture/camera_conventions.h"
#include "capture/layouts/frame_files.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/foreign_hdf5.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/tensor.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

const WorldConvention kDnaWorld = {1, ""};
const WorldConvention kDnaWritten = {1, "y"};
constexpr double kDnaFps = 15;

/// main/<id>.smc and its annotations, not yet listed; empty if there are none.
DnaFiles files_of(const fs::path& path) {
  const auto annotations_of = [](const fs::path& main) {
    const std::string name = main.stem().string() + "_annots.smc";
    for (const fs::path& folder : {main.parent_path(), main.parent_path() / ".." / "annotations"}) {
      if (fs::is_regular_file(folder / name)) {
        return (folder / name).lexically_normal();
      }
    }
    return fs::path();
  };
  std::vector<fs::path> candidates;
  if (fs::is_regular_file(path)) {
    candidates = {path};
  } else {
    for (const fs::path& folder : {path / "main", path}) {
      const std::vector<fs::path> found = files_ending(folder, ".smc");
      candidates.insert(candidates.end(), found.begin(), found.end());
    }
  }
  for (const fs::path& main : candidates) {
    const fs::path annotations = annotations_of(main);
    if (!annotations.empty()) {
      return {main, annotations, {}, {}};
    }
  }
  return {};
}

/// "3" of "03": ids appear in both forms.
std::string short_id(const std::string& id) {
  std::size_t zeros = 0;
  while (zeros + 1 < id.size() && id[zeros] == '0') {
    ++zeros;
  }
  return id.substr(zeros);
}

std::vector<std::string> parts_of(const std::string& name) {
  std::vector<std::string> parts(1);
  for (const char c : name) {
    if (c == '/') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

Tensor bytes_tensor(std::span<const std::byte> bytes) {
  Tensor tensor;
  tensor.type = ElementType::UInt8;
  tensor.shape = {static_cast<std::int64_t>(bytes.size())};
  tensor.data.assign(bytes.begin(), bytes.end());
  return tensor;
}

std::string two_digits(std::size_t i) {
  return (i < 10 ? "0" : "") + std::to_string(i);
}

Eigen::Matrix4d rigid_of(const Tensor& tensor, const std::string& file, const std::string& name) {
  const RowMatrix matrix = matrix_of(tensor, 4, file, name);
  if ((matrix.rows() != 4 && matrix.rows() != 3) ||
      (matrix.rows() == 4 && matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1))) {
    throw DataError(file, name, "no rigid transform", "4 x 4 with the last row 0 0 0 1");
  }
  Eigen::Matrix4d rigid = Eigen::Matrix4d::Identity();
  rigid.topRows(matrix.rows()) = matrix;
  return rigid;
}

/// The arrays of the calibrations, and the cameras that they are of.
struct CalibrationNames {
  std::vector<std::string> arrays;
  std::map<int, std::string> ids;  ///< by number, as the calibration writes them
};

CalibrationNames calibrations_in(const DnaFiles& files) {
  CalibrationNames names;
  for (const auto& [name, tensor] : files.in_annotations.datasets) {
    const std::vector<std::string> parts = parts_of(name);
    if (parts.size() == 3 && parts[0] == "Camera_Parameter") {
      const std::optional<int> number = frame_number(parts[1]);
      const bool digits = parts[1].find_first_not_of("0123456789") == std::string::npos;
      if (!number || !digits || (names.ids.contains(*number) && names.ids[*number] != parts[1])) {
        throw DataError(files.annotations.string(), name, "a camera '" + plain_name(parts[1]) + "'",
                        "a number, each once");
      }
      names.ids[*number] = parts[1];
      if (parts[2] == "K" || parts[2] == "D" || parts[2] == "RT" ||
          parts[2] == "Color_Calibration") {
        names.arrays.push_back(name);
      }
    }
  }
  if (names.ids.empty()) {
    throw DataError(files.annotations.string(), "Camera_Parameter", "no camera",
                    "groups of K, D and RT");
  }
  return names;
}

/// The camera of one group of the calibration.
Camera camera_in(const std::map<std::string, Tensor>& parameters, const std::string& id,
                 const std::string& file) {
  const std::string group = "Camera_Parameter/" + id + "/";
  const auto tensor = [&](const std::string& key) -> const Tensor& {
    const auto found = parameters.find(group + key);
    if (found == parameters.end()) {
      throw DataError(file, group + key, "nothing", "K, D and RT");
    }
    return found->second;
  };
  OpencvCamera camera;
  camera.id = id;
  const RowMatrix k = matrix_of(tensor("K"), 3, file, group + "K");
  if (k.rows() != 3) {
    throw DataError(file, group + "K", std::to_string(k.rows()) + " rows", "3");
  }
  camera.matrix = k;
  check_finite(tensor("D"), file, group + "D");
  camera.distortion = doubles_of(tensor("D"), file, group + "D");
  const Eigen::Matrix4d rt = rigid_of(tensor("RT"), file, group + "RT");
  camera.rotation = rt.topLeftCorner<3, 3>().transpose();
  camera.translation = -(camera.rotation * rt.topRightCorner<3, 1>());
  if (rt.hasNaN()) {  // open_dataset leaves it out
    camera.rotation.setZero();
    camera.translation.setZero();
  }
  Camera result = camera_of(camera, file);
  const auto color = parameters.find(group + "Color_Calibration");
  if (color != parameters.end()) {
    const RowMatrix matrix = matrix_of(color->second, 3, file, color->first);
    // The matrix brings colours to the common ones, and so undoes the gain; only its diagonal is
    // ours.
    if (matrix.rows() == 3 && matrix.diagonal().minCoeff() > 0) {
      result.gain = matrix.diagonal().cwiseInverse();
    }
  }
  return result;
}

/// Places of the images: Camera_5mp/<id>/color/<frame>.
/// @param index  cameras by their short ids
void list_images(const DnaFiles& files, const std::map<std::string, std::size_t>& index,
                 Dataset& dataset) {
  for (const auto& [name, tensor] : files.in_main.datasets) {
    const std::vector<std::string> parts = parts_of(name);
    if (parts.size() == 4 && parts[0].starts_with("Camera_") && parts[2] == "color") {
      const auto camera = index.find(short_id(parts[1]));
      const std::optional<int> frame = frame_number(parts[3]);
      if (camera != index.end() && frame) {
        dataset.frames[camera->second].images.set(*frame, {files.main, name, -1});
      }
    }
  }
}

/// Places of masks (Mask/<id>/mask/<frame>) and of keypoints (Keypoints_2D/<id>,
/// Keypoints_3D/keypoints3d); an array that holds no keypoints is a finding.
/// @param index  cameras by their short ids
/// @param max_rows  of all arrays of keypoints together
void list_annotations(const DnaFiles& files, const std::map<std::string, std::size_t>& index,
                      std::int64_t max_rows, Dataset& dataset) {
  std::int64_t row_count = 0;  // an array's shape costs a file nothing, a place of a row does
  const auto rows = [&](const Tensor& tensor, const std::string& name, std::int64_t columns) {
    FrameLocations places;
    if (tensor.shape.size() != 3 || tensor.shape[1] < 1 || tensor.shape[2] < columns) {
      dataset.findings.push_back(
          {Severity::Warning, "keypoints-shape", files.annotations.string() + ": " + name,
           "an array of " + shape_text(tensor.shape) + " is no array of keypoints and is left out",
           "write [frames, points, " + std::to_string(columns) + "]"});
      return places;
    }
    if (tensor.shape[0] > max_rows - row_count) {
      throw DataError(files.annotations.string(), name,
                      std::to_string(tensor.shape[0]) + " frames of keypoints",
                      "at most " + std::to_string(max_rows) + " in all arrays");
    }
    row_count += tensor.shape[0];
    for (int i = 0; i < static_cast<int>(tensor.shape[0]); ++i) {
      places.add(i, {files.annotations, name, i});
    }
    return places;
  };
  for (const auto& [name, tensor] : files.in_annotations.datasets) {
    const std::vector<std::string> parts = parts_of(name);
    const auto camera = parts.size() > 1 ? index.find(short_id(parts[1])) : index.end();
    if (parts.size() == 4 && parts[0] == "Mask" && parts[2] == "mask") {
      const std::optional<int> frame = frame_number(parts[3]);
      if (camera != index.end() && frame) {
        dataset.frames[camera->second].masks.set(*frame, {files.annotations, name, -1});
      }
    } else if (parts.size() == 2 && parts[0] == "Keypoints_2D" && camera != index.end()) {
      dataset.frames[camera->second].keypoints = rows(tensor, name, 3);
    } else if (name == "Keypoints_3D/keypoints3d") {
      dataset.keypoints3d = rows(tensor, name, 4);
      dataset.keypoint_schema_3d = "coco_wholebody";
    }
  }
}

}  // namespace

std::string recognize_dna(const fs::path& path) {
  const DnaFiles files = files_of(path);
  return files.main.empty()
             ? ""
             : files.main.filename().string() + " and " + files.annotations.filename().string();
}

Dataset read_dna(const fs::path& path, const DatasetOptions& /*options*/, const Limits& limits) {
  DnaFiles files = files_of(path);
  if (files.main.empty()) {
    throw DataError(path.string(), "", "no pair of *.smc and *_annots.smc",
                    "main/<id>.smc and annotations/<id>_annots.smc");
  }
  files.in_main = foreign_hdf5_contents(files.main, limits);
  files.in_annotations = foreign_hdf5_contents(files.annotations, limits);
  Dataset dataset = dna_dataset(
      files,
      [&](const std::vector<std::string>& names) {
        return read_foreign_hdf5(files.annotations, names, limits);
      },
      limits);
  dataset.root = path;
  return dataset;
}

Dataset dna_dataset(
    const DnaFiles& files,
    const std::function<std::map<std::string, Tensor>(const std::vector<std::string>&)>& read,
    const Limits& limits) {
  Dataset dataset;
  dataset.world_convention = kDnaWorld;
  dataset.keypoint_file = KeypointFile::Rows;
  dataset.keypoint_shift = 0.5;
  dataset.info.keypoint_schema.clear();
  const CalibrationNames names = calibrations_in(files);
  const std::map<std::string, Tensor> parameters = read(names.arrays);  // all in one reading
  std::map<std::string, std::size_t> index;                             // by short id
  for (const auto& [number, id] : names.ids) {
    index[short_id(id)] = dataset.cameras.size();
    dataset.cameras.push_back(camera_in(parameters, id, files.annotations.string()));
  }
  dataset.frames.resize(dataset.cameras.size());
  list_images(files, index, dataset);
  list_annotations(files, index, limits.frames, dataset);
  for (const auto& [name, why] : files.in_main.left_out) {
    dataset.findings.push_back({Severity::Warning, "hdf5-left-out",
                                files.main.string() + ": " + name, why,
                                "nothing, if it is not needed"});
  }
  dataset.info.sequences.push_back({"capture", "clothed", kDnaFps, {}});
  return dataset;
}

std::vector<std::string> write_dna(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost = {
      "frame numbers begin at 0 in each sequence; labels and people but the first are left "
      "out (masks of the person are kept)",
      "attributes of the groups (actor, number of devices and frames) are left out",
      "the frame rate of the layout is 15"};
  Archive images;
  images.schema = "dna.main";
  Archive annotations;
  annotations.schema = "dna.annotations";
  const std::vector<Camera> cameras = cameras_in(source, kDnaWritten);
  const auto frame_count = static_cast<std::int64_t>(source.sequence.frame_ids.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    const auto index = static_cast<Index>(c);
    const std::string parameters = "Camera_Parameter/" + two_digits(c);
    const std::array<double, 5> d = five_distortion(camera, lost);
    annotations.datasets[parameters + "/K"] = tensor_of(RowMatrix(opencv_of(camera).matrix));
    annotations.datasets[parameters + "/D"] = tensor_of(std::vector<double>(d.begin(), d.end()));
    RowMatrix world_from_camera = RowMatrix::Identity(4, 4);
    world_from_camera.topLeftCorner(3, 3) = camera.camera_from_world_rotation.transpose();
    world_from_camera.topRightCorner(3, 1) = camera_center(camera);
    annotations.datasets[parameters + "/RT"] = tensor_of(world_from_camera);
    RowMatrix color = RowMatrix::Zero(3, 3);
    color.diagonal() = camera.gain.cwiseInverse();
    annotations.datasets[parameters + "/Color_Calibration"] = tensor_of(color);
    std::vector<double> points;  // [F,K,3]
    std::int64_t point_count = 0;
    int number = 0;
    for (const int frame : source.sequence.frame_ids) {
      const std::string name = std::to_string(number);
      if (const auto image = source.frames().encoded_image(index, frame)) {
        images.datasets["Camera_5mp/" + std::to_string(c) + "/color/" + name] =
            bytes_tensor(image->bytes);
      }
      if (const auto mask = source.frames().mask(index, frame)) {
        const std::string png = image_bytes(*mask, ImageFormat::Png);
        annotations.datasets["Mask/" + two_digits(c) + "/mask/" + name] =
            bytes_tensor(std::as_bytes(std::span(png)));
      }
      const std::vector<PersonKeypoints> people = source.frames().keypoints(index, frame);
      if (!people.empty() && (point_count == 0 || people.front().points.rows() == point_count)) {
        const Keypoints2d& person = people.front().points;
        point_count = person.rows();
        points.resize(static_cast<std::size_t>(number * point_count * 3));
        for (Index i = 0; i < person.rows(); ++i) {
          const double shift = person.row(i).isZero(0) ? 0 : 0.5;
          points.insert(points.end(), {person(i, 0) - shift, person(i, 1) - shift, person(i, 2)});
        }
      }
      ++number;
    }
    if (point_count > 0) {
      points.resize(static_cast<std::size_t>(frame_count * point_count * 3));
      annotations.datasets["Keypoints_2D/" + two_digits(c)] =
          tensor_of(points, {frame_count, point_count, 3});
    }
  }
  make_private_directory(out / "main");
  make_private_directory(out / "annotations");
  write_archive(out / "main" / (source.sequence.name + ".smc"), images);
  write_archive(out / "annotations" / (source.sequence.name + "_annots.smc"), annotations);
  return lost;
}

}  // namespace atelier
