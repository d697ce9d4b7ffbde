#include "core/io/ground_truth_archive.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "core/archive_arrays.h"
#include "core/error.h"
#include "core/garment_archive.h"
#include "core/io/cameras_file.h"
#include "core/tensor.h"

namespace atelier {
namespace {

using IntRows = Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

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

void put_garment(Archive& archive, const std::string& group, const GroundTruthGarment& truth) {
  put_cloth(archive, group, truth.garment);
  put_seams(archive, group + "/pattern/seam", truth.seams);
}

GroundTruthGarment garment_at(const Archive& archive, const std::string& group,
                              const std::string& name, const std::string& file) {
  GroundTruthGarment truth;
  truth.garment = cloth_at(archive, group, file);
  truth.garment.name = name;
  truth.garment.material.name = name;
  truth.seams = seams_at(archive, group + "/pattern/seam", truth.garment.rest.rows(), file);
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
  const bool absent = find_array(archive, name) == nullptr;
  auto points = rows_at<Points>(archive, name, 3, absent && !always ? -1 : rows, file);
  const double most = Limits{}.mesh_coordinate;
  if (points.size() > 0 && points.cwiseAbs().maxCoeff() > most) {
    throw DataError(file, name, "a coordinate beyond reason", "metres");
  }
  return points;
}

ByteImage seen_at(const Archive& archive, const std::string& name, Index vertices, Index cameras,
                  const std::string& file) {
  const Tensor* tensor = find_array(archive, name);
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
  put_array(archive, name, tensor_of(image.data, {image.height, image.width}));
}

}  // namespace

Archive archive_of(const GroundTruth& truth) {
  Archive archive;
  archive.schema = "atelier.truth";
  archive.numbers = truth.numbers;
  archive.texts = truth.texts;
  archive.texts["cameras"] = cameras_json(truth.cameras);
  put_mesh(archive, "body", truth.body);
  put_array(archive, "skeleton/names", tensor_of_texts(truth.skeleton.names));
  put_array(archive, "skeleton/parents", tensor_of(truth.skeleton.parents));
  put_array(archive, "skeleton/offsets", tensor_of(truth.skeleton.offsets));
  put_array(archive, "skeleton/rest_rotations", tensor_of(truth.skeleton.rest_rotations));
  put_array(archive, "skin/joints", tensor_of(truth.skin_joints));
  put_array(archive, "skin/weights", tensor_of(truth.skin_weights));
  put_array(archive, "shape/names", tensor_of_texts(truth.shape_names));
  put_array(
      archive, "shape/values",
      tensor_of(std::vector<double>(truth.shape.data(), truth.shape.data() + truth.shape.size())));
  put_array(archive, "layer_names", tensor_of_texts(truth.layer_names));
  for (std::size_t i = 0; i < truth.layers.size(); ++i) {
    put_mesh(archive, "layers/" + truth.layer_names[i], truth.layers[i]);
  }
  std::vector<std::string> names;
  std::vector<std::string> labels;
  for (const GroundTruthGarment& garment : truth.garments) {
    names.push_back(garment.garment.name);
    labels.push_back(label_name(garment.label));
    put_garment(archive, "garments/" + garment.garment.name, garment);
  }
  put_array(archive, "garment_names", tensor_of_texts(names));
  put_array(archive, "garment_labels", tensor_of_texts(labels));
  put_array(archive, "keypoint_names", tensor_of_texts(truth.keypoint_names));
  std::vector<double> lights;
  for (const AreaLight& light : truth.lights) {
    append(lights, light.center);
    append(lights, light.half_u);
    append(lights, light.half_v);
    append(lights, light.radiance);
  }
  put_array(archive, "lights/rectangles",
            tensor_of(lights, {static_cast<std::int64_t>(truth.lights.size()), 12}));
  std::vector<double> sky;
  append(sky, truth.environment.zenith);
  append(sky, truth.environment.horizon);
  append(sky, truth.environment.nadir);
  put_array(archive, "lights/environment", tensor_of(sky, {3, 3}));
  return archive;
}

GroundTruth truth_of(const Archive& archive, const std::string& file) {
  GroundTruth truth;
  truth.numbers = archive.numbers;
  truth.texts = archive.texts;
  const auto cameras = truth.texts.find("cameras");
  if (cameras == truth.texts.end()) {
    throw DataError(file, "cameras", "no such text", "the ground-truth cameras");
  }
  truth.cameras = parse_cameras_json(cameras->second, file);
  truth.texts.erase(cameras);
  truth.body = mesh_at(archive, "body", file);
  Skeleton& skeleton = truth.skeleton;
  skeleton.names = texts_at(archive, "skeleton/names", file);
  if (!skeleton.names.empty()) {
    const auto joints = static_cast<Index>(skeleton.names.size());
    for (const std::int64_t parent :
         integers_of(array_at(archive, "skeleton/parents", file), file, "skeleton/parents")) {
      skeleton.parents.push_back(static_cast<int>(std::clamp<std::int64_t>(parent, -1, joints)));
    }
    skeleton.offsets = rows_at<Points>(archive, "skeleton/offsets", 3, joints, file);
    if (find_array(archive, "skeleton/rest_rotations") != nullptr) {
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
  if (const Tensor* shape = find_array(archive, "shape/values")) {
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
      throw DataError(file, "garment_labels", "'" + labels[i] + "'",
                      "a label of docs/reference/formats.md");
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
  if (find_array(archive, "lights/environment") != nullptr) {
    const auto sky = rows_at<RowMatrix>(archive, "lights/environment", 3, 3, file);
    truth.environment.zenith = radiance(sky.row(0).transpose(), file, "lights/environment");
    truth.environment.horizon = radiance(sky.row(1).transpose(), file, "lights/environment");
    truth.environment.nadir = radiance(sky.row(2).transpose(), file, "lights/environment");
  }
  return truth;
}

Archive archive_of(const GroundTruthFrame& frame, const GroundTruth& truth) {
  ATELIER_CHECK(
      frame.garments.size() == truth.garments.size() && frame.layers.size() == truth.layers.size(),
      "a frame has as many garments and layers as its capture");
  Archive archive;
  archive.schema = "atelier.truth.frame";
  archive.numbers["frame_id"] = frame.frame_id;
  put_array(archive, "joints", tensor_of(frame.joints));
  if (frame.pose.rotations.rows() > 0) {
    put_array(archive, "pose/rotations", tensor_of(frame.pose.rotations));
    const Eigen::Vector3d& t = frame.pose.root_translation;
    put_array(archive, "pose/root_translation",
              tensor_of(std::vector<double>{t.x(), t.y(), t.z()}));
  }
  put_array(archive, "keypoints", tensor_of(frame.keypoints));
  put_array(archive, "body", tensor_of(frame.body));
  put_seen(archive, "seen/body", frame.body_seen);
  for (std::size_t i = 0; i < truth.layers.size(); ++i) {
    put_array(archive, "layers/" + truth.layer_names[i], tensor_of(frame.layers[i]));
  }
  for (std::size_t i = 0; i < truth.garments.size(); ++i) {
    const std::string& name = truth.garments[i].garment.name;
    put_array(archive, "garments/" + name, tensor_of(frame.garments[i]));
    if (i < frame.garments_seen.size()) {
      put_seen(archive, "seen/garments/" + name, frame.garments_seen[i]);
    }
  }
  return archive;
}

GroundTruthFrame ground_truth_frame_of(const Archive& archive, const GroundTruth& truth,
                                       const std::string& file) {
  GroundTruthFrame frame;
  const auto id = archive.numbers.find("frame_id");
  if (id == archive.numbers.end() || id->second < 0 || id->second > 999'999'999 ||
      id->second != std::floor(id->second)) {
    throw DataError(file, "frame_id", "missing or out of range", "the frame's number");
  }
  frame.frame_id = static_cast<int>(id->second);
  const auto joints = static_cast<Index>(truth.skeleton.names.size());
  const auto cameras = static_cast<Index>(truth.cameras.size());
  frame.joints = points_frame(archive, "joints", joints, file);
  if (find_array(archive, "pose/rotations") != nullptr) {
    frame.pose.rotations = points_frame(archive, "pose/rotations", joints, file);
    const Tensor& translation = array_at(archive, "pose/root_translation", file);
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
  for (const GroundTruthGarment& garment : truth.garments) {
    const std::string& name = garment.garment.name;
    const Index rows = garment.garment.mesh.vertices.rows();
    frame.garments.push_back(points_frame(archive, "garments/" + name, rows, file));
    frame.garments_seen.push_back(seen_at(archive, "seen/garments/" + name, rows, cameras, file));
  }
  return frame;
}

GroundTruth read_ground_truth(const std::filesystem::path& capture, const Limits& limits) {
  const std::filesystem::path path = capture / "truth" / "truth.h5";
  std::error_code unseen;
  if (!std::filesystem::exists(path, unseen)) {
    throw DataError(capture.string(), "", "no truth/truth.h5",
                    "a synthetic capture, which has its ground truth");
  }
  return truth_of(read_archive(path, "atelier.truth", 1, limits), path.string());
}

GroundTruthFrame read_ground_truth_frame(const std::filesystem::path& capture,
                                         const GroundTruth& truth, int frame_id,
                                         const Limits& limits) {
  const std::filesystem::path path = capture / "truth" / "frames" / (frame_name(frame_id) + ".h5");
  return ground_truth_frame_of(read_archive(path, "atelier.truth.frame", 1, limits), truth,
                               path.string());
}

}  // namespace atelier
