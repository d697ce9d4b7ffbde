#include "capture/truth_archive.h"

#include <algorithm>
#include <cstdio>

#include "capture/cameras_file.h"
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
  for (auto& [name, tensor] : archive_of(mesh).datasets) {
    archive.datasets[group + "/" + name] = tensor;
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
  if (tensor == nullptr) {
    return Matrix(0, columns < 0 ? 0 : columns);
  }
  const RowMatrix matrix = matrix_of(*tensor, columns, file, name);
  if (rows >= 0 && matrix.rows() != rows) {
    throw DataError(file, name, std::to_string(matrix.rows()) + " rows", std::to_string(rows));
  }
  return matrix.template cast<typename Matrix::Scalar>();
}

template <class Array>
void check_range(const Array& indices, Index count, const std::string& file,
                 const std::string& name) {
  if (indices.size() > 0 && (indices.minCoeff() < 0 || indices.maxCoeff() >= count)) {
    throw DataError(file, name, "an index outside [0, " + std::to_string(count) + ")",
                    "indices of what it refers to");
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
  garment.rest_faces = rows_at<Triangles>(archive, group + "/pattern/rest_faces", 3, -1, file);
  check_range(garment.rest_faces, garment.rest.rows(), file, group + "/pattern/rest_faces");
  if (const Tensor* panels = find(archive, group + "/pattern/panels")) {
    for (const std::int64_t panel : integers_of(*panels, file, group + "/pattern/panels")) {
      garment.panels.push_back(static_cast<int>(panel));
    }
  }
  garment.panel_names = texts_at(archive, group + "/pattern/panel_names", file);
  for (const std::string& seam : texts_at(archive, group + "/pattern/seam_names", file)) {
    truth.seams.push_back({seam, {}, {}});
  }
  const auto pairs = rows_at<IntRows>(archive, group + "/pattern/seams", 3, -1, file);
  for (Index i = 0; i < pairs.rows(); ++i) {
    if (pairs(i, 0) < 0 || pairs(i, 0) >= static_cast<int>(truth.seams.size()) ||
        std::min(pairs(i, 1), pairs(i, 2)) < 0 ||
        std::max(pairs(i, 1), pairs(i, 2)) >= garment.rest.rows()) {
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

Points points_frame(const Archive& archive, const std::string& name, Index rows,
                    const std::string& file) {
  return rows_at<Points>(archive, name, 3, find(archive, name) == nullptr ? -1 : rows, file);
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
  truth.skin_joints = rows_at<IntRows>(archive, "skin/joints", -1, -1, file);
  check_range(truth.skin_joints, static_cast<Index>(skeleton.names.size()), file, "skin/joints");
  truth.skin_weights = rows_at<RowMatrix>(archive, "skin/weights", -1, -1, file);
  truth.shape_names = texts_at(archive, "shape/names", file);
  if (const Tensor* shape = find(archive, "shape/values")) {
    const std::vector<double> values = doubles_of(*shape, file, "shape/values");
    truth.shape =
        Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Index>(values.size()));
  }
  truth.layer_names = texts_at(archive, "layer_names", file);
  for (const std::string& name : truth.layer_names) {
    truth.layers.push_back(mesh_at(archive, "layers/" + name, file));
  }
  const std::vector<std::string> labels = texts_at(archive, "garment_labels", file);
  for (const std::string& name : texts_at(archive, "garment_names", file)) {
    truth.garments.push_back(garment_at(archive, "garments/" + name, name, file));
    const std::size_t i = truth.garments.size() - 1;
    truth.garments[i].label =
        i < labels.size() ? label_of(labels[i]).value_or(Label::Unknown) : Label::Unknown;
  }
  truth.keypoint_names = texts_at(archive, "keypoint_names", file);
  const auto lights = rows_at<RowMatrix>(archive, "lights/rectangles", 12, -1, file);
  for (Index i = 0; i < lights.rows(); ++i) {
    const auto part = [&](int first) -> Eigen::Vector3d {
      return lights.block<1, 3>(i, first).transpose();
    };
    truth.lights.push_back({part(0), part(3), part(6), part(9).cast<float>()});
  }
  const auto sky = rows_at<RowMatrix>(archive, "lights/environment", 3, 3, file);
  if (sky.rows() == 3) {
    truth.environment.zenith = sky.row(0).transpose().cast<float>();
    truth.environment.horizon = sky.row(1).transpose().cast<float>();
    truth.environment.nadir = sky.row(2).transpose().cast<float>();
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
  if (id == archive.numbers.end() || id->second < 0 || id->second > 999'999'999) {
    throw DataError(file, "frame_id", "missing or out of range", "the frame's number");
  }
  frame.frame_id = static_cast<int>(id->second);
  const auto joints = static_cast<Index>(truth.skeleton.names.size());
  const auto cameras = static_cast<Index>(truth.cameras.size());
  frame.joints = points_frame(archive, "joints", joints, file);
  if (find(archive, "pose/rotations") != nullptr) {
    frame.pose.rotations = points_frame(archive, "pose/rotations", joints, file);
    const std::vector<double> t = doubles_of(at(archive, "pose/root_translation", file), file);
    if (t.size() != 3) {
      throw DataError(file, "pose/root_translation", std::to_string(t.size()), "3 numbers");
    }
    frame.pose.root_translation = {t[0], t[1], t[2]};
  }
  frame.keypoints =
      points_frame(archive, "keypoints", static_cast<Index>(truth.keypoint_names.size()), file);
  frame.body = points_frame(archive, "body", truth.body.vertices.rows(), file);
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
