#include "capture/truth_archive.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "capture/cameras_file.h"
#include "capture/capture_info.h"
#include "core/error.h"
#include "core/sequence_archive.h"
#include "core/tensor.h"

namespace atelier {
namespace {

using IntRows = Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Tensor texts(const std::vector<std::string>& values) {
  Tensor tensor;
  tensor.type = ElementType::Text;
  tensor.shape = {static_cast<std::int64_t>(values.size())};
  tensor.strings = values;
  return tensor;
}

/// A dataset that HDF5 can hold: those without elements are left out.
void put(Archive& archive, const std::string& name, Tensor tensor) {
  if (element_count(tensor) > 0) {
    archive.datasets[name] = std::move(tensor);
  }
}

void put_mesh(Archive& archive, const std::string& group, const Mesh& mesh) {
  const std::string folder = group + "/";
  for (auto& [name, tensor] : archive_of(mesh).datasets) {
    archive.datasets[folder + name] = tensor;
  }
}

Mesh mesh_at(const Archive& archive, const std::string& group, const std::string& file) {
  Archive part;
  part.schema = "atelier.mesh";
  for (const auto& [name, tensor] : archive.datasets) {
    if (name.starts_with(group + "/") && name.find('/', group.size() + 1) == std::string::npos) {
      part.datasets[name.substr(group.size() + 1)] = tensor;
    }
  }
  return mesh_of(part, file);
}

const Tensor* find(const Archive& archive, const std::string& name) {
  const auto found = archive.datasets.find(name);
  return found == archive.datasets.end() ? nullptr : &found->second;
}

const Tensor& at(const Archive& archive, const std::string& name, const std::string& file) {
  const Tensor* tensor = find(archive, name);
  if (tensor == nullptr) {
    throw DataError(file, name, "no such dataset", "one of schema " + archive.schema);
  }
  return *tensor;
}

std::vector<std::string> texts_at(const Archive& archive, const std::string& name,
                                  const std::string& file) {
  const Tensor* tensor = find(archive, name);
  if (tensor == nullptr) {
    return {};
  }
  if (tensor->type != ElementType::Text || tensor->shape.size() != 1) {
    throw DataError(file, name, element_type_name(tensor->type), "a list of texts");
  }
  return tensor->strings;
}

/// [N,columns] of numbers; no rows where it is absent. `rows` below 0: any number.
template <class Matrix>
Matrix rows_at(const Archive& archive, const std::string& name, Index columns, Index rows,
               const std::string& file) {
  const Tensor* tensor = find(archive, name);
  Matrix matrix =
      tensor == nullptr
          ? Matrix(0, columns < 0 ? 0 : columns)
          : Matrix(
                matrix_of(*tensor, columns, file, name).template cast<typename Matrix::Scalar>());
  if (rows >= 0 && matrix.rows() != rows) {
    throw DataError(file, name, std::to_string(matrix.rows()) + " rows", std::to_string(rows));
  }
  return matrix;
}

/// Indices into `count` things, in the order of the file.
std::vector<int> indices_of(const Tensor& tensor, Index count, const std::string& file,
                            const std::string& name) {
  std::vector<int> indices;
  for (const std::int64_t index : integers_of(tensor, file, name)) {
    if (index < 0 || index >= count) {
      throw DataError(file, name, "index " + std::to_string(index),
                      "indices in [0, " + std::to_string(count) + ")");
    }
    indices.push_back(static_cast<int>(index));
  }
  return indices;
}

/// [N,columns] of indices into `count` things; no rows where it is absent. `columns` below 0: any.
template <class Matrix>
Matrix index_rows_at(const Archive& archive, const std::string& name, Index columns, Index count,
                     const std::string& file) {
  const Tensor* tensor = find(archive, name);
  if (tensor == nullptr) {
    return Matrix(0, columns < 0 ? 0 : columns);
  }
  if (tensor->shape.size() != 2 || (columns >= 0 && tensor->shape[1] != columns)) {
    throw DataError(file, name, shape_text(tensor->shape), "rows of indices");
  }
  const std::vector<int> indices = indices_of(*tensor, count, file, name);
  return Eigen::Map<const Matrix>(indices.data(), tensor->shape[0], tensor->shape[1]);
}

/// Names of groups in the archive: none twice, none that is two.
std::vector<std::string> group_names_at(const Archive& archive, const std::string& name,
                                        const std::string& file) {
  std::vector<std::string> names = texts_at(archive, name, file);
  std::set<std::string> seen;
  for (const std::string& group : names) {
    if (!is_plain_name(group) || !seen.insert(group).second) {
      throw DataError(file, name, "'" + group + "'",
                      "letters, digits, '.', '_' and '-', each name once");
    }
  }
  return names;
}

void check_count(std::size_t found, Index expected, const std::string& file,
                 const std::string& name) {
  if (static_cast<Index>(found) != expected) {
    throw DataError(file, name, std::to_string(found), std::to_string(expected));
  }
}

std::vector<double> material_numbers(const Material& m) {
  return {m.density, m.stretch_warp, m.stretch_weft, m.shear,
          m.bending, m.damping,      m.friction,     m.thickness};
}

void put_garment(Archive& archive, const std::string& group, const TruthGarment& truth) {
  const Garment& garment = truth.garment;
  put_mesh(archive, group, garment.mesh);
  put(archive, group + "/pattern/rest", tensor_of(garment.rest));
  put(archive, group + "/pattern/rest_faces", tensor_of(garment.rest_faces));
  put(archive, group + "/pattern/panels", tensor_of(garment.panels));
  put(archive, group + "/pattern/panel_names", texts(garment.panel_names));
  std::vector<int> pairs;
  std::vector<std::string> names;
  for (std::size_t s = 0; s < truth.seams.size(); ++s) {
    names.push_back(truth.seams[s].name);
    for (std::size_t i = 0; i < truth.seams[s].a.size(); ++i) {
      pairs.insert(pairs.end(), {static_cast<int>(s), truth.seams[s].a[i], truth.seams[s].b[i]});
    }
  }
  put(archive, group + "/pattern/seams",
      tensor_of(pairs, {static_cast<std::int64_t>(pairs.size() / 3), 3}));
  put(archive, group + "/pattern/seam_names", texts(names));
  put(archive, group + "/material/values", tensor_of(material_numbers(garment.material)));
}

TruthGarment garment_at(const Archive& archive, const std::string& group, const std::string& name,
                        const std::string& file) {
  TruthGarment truth;
  Garment& garment = truth.garment;
  garment.name = name;
  garment.mesh = mesh_at(archive, group, file);
  garment.rest = rows_at<Points2>(archive, group + "/pattern/rest", 2, -1, file);
  garment.rest_faces = index_rows_at<Triangles>(archive, group + "/pattern/rest_faces", 3,
                                                garment.rest.rows(), file);
  garment.panel_names = texts_at(archive, group + "/pattern/panel_names", file);
  if (const Tensor* panels = find(archive, group + "/pattern/panels")) {
    garment.panels = indices_of(*panels, static_cast<Index>(garment.panel_names.size()), file,
                                group + "/pattern/panels");
  }
  for (const std::string& seam : texts_at(archive, group + "/pattern/seam_names", file)) {
    truth.seams.push_back({seam, {}, {}});
  }
  const auto seams = static_cast<Index>(truth.seams.size());
  const auto pairs = index_rows_at<IntRows>(archive, group + "/pattern/seams", 3,
                                            std::max(seams, garment.rest.rows()), file);
  for (Index i = 0; i < pairs.rows(); ++i) {
    if (pairs(i, 0) >= seams || std::max(pairs(i, 1), pairs(i, 2)) >= garment.rest.rows()) {
      throw DataError(file, group + "/pattern/seams", "row " + std::to_string(i),
                      "a seam and two rows of rest");
    }
    Seam& seam = truth.seams[static_cast<std::size_t>(pairs(i, 0))];
    seam.a.push_back(pairs(i, 1));
    seam.b.push_back(pairs(i, 2));
  }
  const std::vector<double> m =
      doubles_of(at(archive, group + "/material/values", file), file, group + "/material/values");
  if (m.size() != material_numbers({}).size()) {
    throw DataError(file, group + "/material/values", std::to_string(m.size()), "8 numbers");
  }
  garment.material = {name, m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7]};
  check_garment(garment, file);
  return truth;
}

template <class Vector>
void append(std::vector<double>& values, const Vector& vector) {
  for (int c = 0; c < 3; ++c) {
    values.push_back(vector[c]);
  }
}

/// Light of three channels as the renderer takes it.
Eigen::Vector3f radiance(const Eigen::Vector3d& light, const std::string& file,
                         const std::string& name) {
  constexpr double kMost = 1e12;  // far from where products of floats overflow
  if (light.minCoeff() < 0 || light.maxCoeff() > kMost) {
    throw DataError(file, name, "a radiance below 0 or beyond reason", "0 to 1e12");
  }
  return light.cast<float>();
}

/// Points of a frame: one for each of `rows` things, or none where they were not there.
Points points_frame(const Archive& archive, const std::string& name, Index rows,
                    const std::string& file, bool always = false) {
  const bool absent = find(archive, name) == nullptr;
  auto points = rows_at<Points>(archive, name, 3, absent && !always ? -1 : rows, file);
  const double most = Limits{}.mesh_coordinate;
  if (points.size() > 0 && points.cwiseAbs().maxCoeff() > most) {
    throw DataError(file, name, "a coordinate beyond reason", "metres");
  }
  return points;
}

ByteImage seen_at(const Archive& archive, const std::string& name, Index vertices, Index cameras,
                  const std::string& file) {
  const Tensor* tensor = find(archive, name);
  if (tensor == nullptr) {
    return {};
  }
  if (tensor->type != ElementType::UInt8 ||
      tensor->shape != std::vector<std::int64_t>{cameras, vertices}) {
    throw DataError(file, name, shape_text(tensor->shape), "uint8 [cameras, vertices]");
  }
  ByteImage image(static_cast<int>(vertices), static_cast<int>(cameras), 1);
  const std::span<const std::uint8_t> values = values_of<std::uint8_t>(*tensor);
  std::copy(values.begin(), values.end(), image.data.begin());
  return image;
}

void put_seen(Archive& archive, const std::string& name, const ByteImage& image) {
  put(archive, name, tensor_of(image.data, {image.height, image.width}));
}

}  // namespace

std::string frame_name(int frame_id) {
  char name[16];
  std::snprintf(name, sizeof(name), "%06d", frame_id);
  return name;
}

Archive archive_of(const CaptureTruth& truth) {
  Archive archive;
  archive.schema = "atelier.truth";
  archive.numbers = truth.numbers;
  archive.texts = truth.texts;
  archive.texts["cameras"] = cameras_json(truth.cameras);
  put_mesh(archive, "body", truth.body);
  put(archive, "skeleton/names", texts(truth.skeleton.names));
  put(archive, "skeleton/parents", tensor_of(truth.skeleton.parents));
  put(archive, "skeleton/offsets", tensor_of(truth.skeleton.offsets));
  put(archive, "skeleton/rest_rotations", tensor_of(truth.skeleton.rest_rotations));
  put(archive, "skin/joints", tensor_of(truth.skin_joints));
  put(archive, "skin/weights", tensor_of(truth.skin_weights));
  put(archive, "shape/names", texts(truth.shape_names));
  put(archive, "shape/values",
      tensor_of(std::vector<double>(truth.shape.data(), truth.shape.data() + truth.shape.size())));
  put(archive, "layer_names", texts(truth.layer_names));
  for (std::size_t i = 0; i < truth.layers.size(); ++i) {
    put_mesh(archive, "layers/" + truth.layer_names[i], truth.layers[i]);
  }
  std::vector<std::string> names;
  std::vector<std::string> labels;
  for (const TruthGarment& garment : truth.garments) {
    names.push_back(garment.garment.name);
    labels.push_back(label_name(garment.label));
    put_garment(archive, "garments/" + garment.garment.name, garment);
  }
  put(archive, "garment_names", texts(names));
  put(archive, "garment_labels", texts(labels));
  put(archive, "keypoint_names", texts(truth.keypoint_names));
  std::vector<double> lights;
  for (const AreaLight& light : truth.lights) {
    append(lights, light.center);
    append(lights, light.half_u);
    append(lights, light.half_v);
    append(lights, light.radiance);
  }
  put(archive, "lights/rectangles",
      tensor_of(lights, {static_cast<std::int64_t>(truth.lights.size()), 12}));
  std::vector<double> sky;
  append(sky, truth.environment.zenith);
  append(sky, truth.environment.horizon);
  append(sky, truth.environment.nadir);
  put(archive, "lights/environment", tensor_of(sky, {3, 3}));
  return archive;
}

CaptureTruth truth_of(const Archive& archive, const std::string& file) {
  CaptureTruth truth;
  truth.numbers = archive.numbers;
  truth.texts = archive.texts;
  const auto cameras = truth.texts.find("cameras");
  if (cameras == truth.texts.end()) {
    throw DataError(file, "cameras", "no such text", "the true cameras");
  }
  truth.cameras = parse_cameras_json(cameras->second, file);
  truth.texts.erase(cameras);
  truth.body = mesh_at(archive, "body", file);
  Skeleton& skeleton = truth.skeleton;
  skeleton.names = texts_at(archive, "skeleton/names", file);
  if (!skeleton.names.empty()) {
    const auto joints = static_cast<Index>(skeleton.names.size());
    for (const std::int64_t parent :
         integers_of(at(archive, "skeleton/parents", file), file, "skeleton/parents")) {
      skeleton.parents.push_back(static_cast<int>(std::clamp<std::int64_t>(parent, -1, joints)));
    }
    skeleton.offsets = rows_at<Points>(archive, "skeleton/offsets", 3, joints, file);
    if (find(archive, "skeleton/rest_rotations") != nullptr) {
      skeleton.rest_rotations =
          rows_at<Points>(archive, "skeleton/rest_rotations", 3, joints, file);
    }
    check_skeleton(skeleton, file);
  }
  truth.skin_joints = index_rows_at<IntRows>(archive, "skin/joints", -1,
                                             static_cast<Index>(skeleton.names.size()), file);
  truth.skin_weights = rows_at<RowMatrix>(archive, "skin/weights", -1, -1, file);
  if (truth.skin_weights.rows() != truth.skin_joints.rows() ||
      truth.skin_weights.cols() != truth.skin_joints.cols() ||
      (truth.skin_joints.rows() > 0 && truth.skin_joints.rows() != truth.body.vertices.rows())) {
    throw DataError(file, "skin", "joints and weights of other shapes", "one row for each vertex");
  }
  truth.shape_names = texts_at(archive, "shape/names", file);
  if (const Tensor* shape = find(archive, "shape/values")) {
    check_finite(*shape, file, "shape/values");
    const std::vector<double> values = doubles_of(*shape, file, "shape/values");
    truth.shape =
        Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Index>(values.size()));
  }
  check_count(truth.shape_names.size(), truth.shape.size(), file, "shape/names");
  truth.layer_names = group_names_at(archive, "layer_names", file);
  for (const std::string& name : truth.layer_names) {
    truth.layers.push_back(mesh_at(archive, "layers/" + name, file));
  }
  const std::vector<std::string> garments = group_names_at(archive, "garment_names", file);
  const std::vector<std::string> labels = texts_at(archive, "garment_labels", file);
  check_count(labels.size(), static_cast<Index>(garments.size()), file, "garment_labels");
  for (std::size_t i = 0; i < garments.size(); ++i) {
    truth.garments.push_back(garment_at(archive, "garments/" + garments[i], garments[i], file));
    const std::optional<Label> label = label_of(labels[i]);
    if (!label) {
      throw DataError(file, "garment_labels", "'" + labels[i] + "'", "a label of docs/formats.md");
    }
    truth.garments[i].label = *label;
  }
  truth.keypoint_names = texts_at(archive, "keypoint_names", file);
  const auto lights = rows_at<RowMatrix>(archive, "lights/rectangles", 12, -1, file);
  for (Index i = 0; i < lights.rows(); ++i) {
    const auto part = [&](int first) -> Eigen::Vector3d {
      return lights.block<1, 3>(i, first).transpose();
    };
    truth.lights.push_back(
        {part(0), part(3), part(6), radiance(part(9), file, "lights/rectangles")});
  }
  if (find(archive, "lights/environment") != nullptr) {
    const auto sky = rows_at<RowMatrix>(archive, "lights/environment", 3, 3, file);
    truth.environment.zenith = radiance(sky.row(0).transpose(), file, "lights/environment");
    truth.environment.horizon = radiance(sky.row(1).transpose(), file, "lights/environment");
    truth.environment.nadir = radiance(sky.row(2).transpose(), file, "lights/environment");
  }
  return truth;
}

Archive archive_of(const TruthFrame& frame, const CaptureTruth& truth) {
  ATELIER_CHECK(
      frame.garments.size() == truth.garments.size() && frame.layers.size() == truth.layers.size(),
      "a frame has as many garments and layers as its capture");
  Archive archive;
  archive.schema = "atelier.truth.frame";
  archive.numbers["frame_id"] = frame.frame_id;
  put(archive, "joints", tensor_of(frame.joints));
  if (frame.pose.rotations.rows() > 0) {
    put(archive, "pose/rotations", tensor_of(frame.pose.rotations));
    const Eigen::Vector3d& t = frame.pose.root_translation;
    put(archive, "pose/root_translation", tensor_of(std::vector<double>{t.x(), t.y(), t.z()}));
  }
  put(archive, "keypoints", tensor_of(frame.keypoints));
  put(archive, "body", tensor_of(frame.body));
  put_seen(archive, "seen/body", frame.body_seen);
  for (std::size_t i = 0; i < truth.layers.size(); ++i) {
    put(archive, "layers/" + truth.layer_names[i], tensor_of(frame.layers[i]));
  }
  for (std::size_t i = 0; i < truth.garments.size(); ++i) {
    const std::string& name = truth.garments[i].garment.name;
    put(archive, "garments/" + name, tensor_of(frame.garments[i]));
    if (i < frame.garments_seen.size()) {
      put_seen(archive, "seen/garments/" + name, frame.garments_seen[i]);
    }
  }
  return archive;
}

TruthFrame truth_frame_of(const Archive& archive, const CaptureTruth& truth,
                          const std::string& file) {
  TruthFrame frame;
  const auto id = archive.numbers.find("frame_id");
  if (id == archive.numbers.end() || id->second < 0 || id->second > 999'999'999 ||
      id->second != std::floor(id->second)) {
    throw DataError(file, "frame_id", "missing or out of range", "the frame's number");
  }
  frame.frame_id = static_cast<int>(id->second);
  const auto joints = static_cast<Index>(truth.skeleton.names.size());
  const auto cameras = static_cast<Index>(truth.cameras.size());
  frame.joints = points_frame(archive, "joints", joints, file);
  if (find(archive, "pose/rotations") != nullptr) {
    frame.pose.rotations = points_frame(archive, "pose/rotations", joints, file);
    const Tensor& translation = at(archive, "pose/root_translation", file);
    check_finite(translation, file, "pose/root_translation");
    const std::vector<double> t = doubles_of(translation, file, "pose/root_translation");
    check_count(t.size(), 3, file, "pose/root_translation");
    frame.pose.root_translation = {t[0], t[1], t[2]};
  }
  frame.keypoints = points_frame(archive, "keypoints",
                                 static_cast<Index>(truth.keypoint_names.size()), file, true);
  frame.body = points_frame(archive, "body", truth.body.vertices.rows(), file, true);
  frame.body_seen = seen_at(archive, "seen/body", truth.body.vertices.rows(), cameras, file);
  for (std::size_t i = 0; i < truth.layers.size(); ++i) {
    frame.layers.push_back(points_frame(archive, "layers/" + truth.layer_names[i],
                                        truth.layers[i].vertices.rows(), file));
  }
  for (const TruthGarment& garment : truth.garments) {
    const std::string& name = garment.garment.name;
    const Index rows = garment.garment.mesh.vertices.rows();
    frame.garments.push_back(points_frame(archive, "garments/" + name, rows, file));
    frame.garments_seen.push_back(seen_at(archive, "seen/garments/" + name, rows, cameras, file));
  }
  return frame;
}

CaptureTruth read_capture_truth(const std::filesystem::path& capture, const Limits& limits) {
  const std::filesystem::path path = capture / "truth" / "truth.h5";
  return truth_of(read_archive(path, "atelier.truth", 1, limits), path.string());
}

TruthFrame read_truth_frame(const std::filesystem::path& capture, const CaptureTruth& truth,
                            int frame_id, const Limits& limits) {
  const std::filesystem::path path = capture / "truth" / "frames" / (frame_name(frame_id) + ".h5");
  return truth_frame_of(read_archive(path, "atelier.truth.frame", 1, limits), truth, path.string());
}

}  // namespace atelier
