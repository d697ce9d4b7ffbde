#include "appearance/painted_scene.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/archive_arrays.h"
#include "core/check_bounded.h"
#include "core/error.h"
#include "core/limits.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr const char* kPaintedSchema = "atelier.painted_scene";
constexpr Index kNumbers = 30;  // of a camera

using CameraRow = Eigen::Matrix<double, 1, kNumbers>;

CameraRow row_of(const Camera& camera) {
  CameraRow row;
  row << camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
      static_cast<double>(camera.distortion_model),
      Eigen::Map<const Eigen::Matrix<double, 1, 8>>(camera.distortion.data()),
      camera.camera_from_world_rotation.row(0), camera.camera_from_world_rotation.row(1),
      camera.camera_from_world_rotation.row(2), camera.camera_from_world_translation.transpose(),
      camera.gain.transpose();
  return row;
}

Camera camera_of(const CameraRow& row, const std::string& id, const std::string& file) {
  constexpr double kLargestSide = 32768;
  const auto whole = [&](Index i, double low, double high) {
    return row[i] >= low && row[i] <= high && row[i] == std::floor(row[i]);
  };
  if (!whole(0, 1, kLargestSide) || !whole(1, 1, kLargestSide) || !whole(6, 0, 2)) {
    throw DataError(file, "cameras", "a size or lens that no camera has",
                    "1 to 32768 pixels a side, and lens 0, 1 or 2");
  }
  Camera camera;
  camera.id = id;
  camera.width = static_cast<int>(row[0]);
  camera.height = static_cast<int>(row[1]);
  camera.fx = row[2];
  camera.fy = row[3];
  camera.cx = row[4];
  camera.cy = row[5];
  camera.distortion_model = static_cast<Distortion>(static_cast<int>(row[6]));
  std::copy_n(row.data() + 7, 8, camera.distortion.begin());
  for (Index i = 0; i < 3; ++i) {
    camera.camera_from_world_rotation.row(i) = row.segment<3>(15 + 3 * i);
  }
  camera.camera_from_world_translation = row.segment<3>(24).transpose();
  camera.gain = row.segment<3>(27).transpose();
  check_camera(camera, file);
  return camera;
}

std::string group_of(std::size_t layer) {
  return "layers/" + std::to_string(layer);
}

std::size_t layer_count(const Archive& archive, const std::string& file) {
  constexpr double kMaxLayers = 1000;
  const auto found = archive.numbers.find("layers");
  const double count = found == archive.numbers.end() ? 0 : found->second;
  if (!(count >= 1 && count <= kMaxLayers && count == std::floor(count))) {
    throw DataError(file, "layers", std::to_string(count), "1 to 1000");
  }
  return saturating_cast<std::size_t>(count);
}

void check_scene_names(const Archive& archive, std::size_t layers, const std::string& file) {
  std::set<std::string> names = {"cameras/id", "cameras/numbers", "frames/id"};
  for (std::size_t i = 0; i < layers; ++i) {
    for (const char* part : {"/color", "/faces", "/worn", "/vertices"}) {
      names.insert(group_of(i) + part);
    }
  }
  check_names(archive, file, [&](const std::string& name) { return names.contains(name); });
}

/// A layer's places in the frames where it is worn; no rows in the others.
std::vector<Points> vertices_of(const Archive& archive, const std::string& group, Index frames,
                                const std::string& file) {
  const std::string place = group + "/vertices";
  const std::vector<int> worn =
      indices_of(array_at(archive, group + "/worn", file), 2, file, group + "/worn");
  if (static_cast<Index>(worn.size()) != frames) {
    throw DataError(file, group + "/worn", std::to_string(worn.size()),
                    "one for each of " + std::to_string(frames) + " frames");
  }
  std::vector<Points> all(worn.size(), Points(0, 3));
  const auto times = std::count(worn.begin(), worn.end(), 1);
  if (times == 0) {
    return all;
  }
  const Tensor& tensor = array_at(archive, place, file);
  const std::int64_t rows = tensor.shape.size() == 3 ? tensor.shape[1] : 0;
  if (tensor.type != ElementType::Float32 || rows == 0 ||
      tensor.shape != std::vector<std::int64_t>{times, rows, 3}) {
    throw DataError(file, place,
                    std::string(element_type_name(tensor.type)) + " " + shape_text(tensor.shape),
                    "float32, three a vertex in each frame where it is worn");
  }
  check_bounded(tensor, Limits{}.mesh_coordinate, file, place);
  const float* values = values_of<float>(tensor).data();
  for (std::size_t f = 0; f < worn.size(); ++f) {
    if (worn[f] != 0) {
      all[f] = Eigen::Map<const FloatRows>(values, rows, 3).cast<double>();
      values += 3 * rows;
    }
  }
  return all;
}

Eigen::Vector3f color_of(const Archive& archive, const std::string& name, const std::string& file) {
  Eigen::Vector3f color = rows_at<FloatRows>(archive, name, 3, 1, file).row(0);
  if (!color.allFinite()) {
    throw DataError(file, name, "a colour beyond single precision", "linear RGB");
  }
  return color;
}

}  // namespace

OptionTable describe(PaintOptions& options) {
  OptionTable table;
  table.add("samples", options.samples, 1, 8, "",
            "Antialiasing samples along each side of a pixel; 1: none, fastest");
  table.add("alpha", options.alpha,
            "Alpha channel with the coverage of each pixel instead of a background");
  table.add("background", options.background, 0, 1, "",
            "Linear red, green and blue of the background");
  table.add("occlusion", describe_open(options.occlusion));
  return table;
}

Archive archive_of(const PaintedScene& scene) {
  const std::size_t frames = scene.frame_ids.size();
  ATELIER_CHECK(scene.vertices.size() == frames && frames > 0 && !scene.layers.empty() &&
                    (scene.cameras.size() == 1 || scene.cameras.size() == frames),
                "a scene has layers, frames and one camera, or one for each frame");
  Archive archive;
  archive.schema = kPaintedSchema;
  archive.numbers["layers"] = static_cast<double>(scene.layers.size());
  Eigen::Matrix<double, Eigen::Dynamic, kNumbers, Eigen::RowMajor> cameras(
      static_cast<Index>(scene.cameras.size()), kNumbers);
  std::vector<std::string> ids;
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    cameras.row(static_cast<Index>(c)) = row_of(scene.cameras[c]);
    ids.push_back(scene.cameras[c].id.empty() ? "-" : scene.cameras[c].id);
  }
  put_array(archive, "cameras/numbers", tensor_of(cameras));
  put_array(archive, "cameras/id", tensor_of_texts(ids));
  put_array(archive, "frames/id", tensor_of(scene.frame_ids));
  for (std::size_t i = 0; i < scene.layers.size(); ++i) {
    const SceneLayer& layer = scene.layers[i];
    std::vector<float> all;
    std::vector<std::uint8_t> worn;
    std::int64_t rows = 0;
    for (const std::vector<Points>& frame : scene.vertices) {
      ATELIER_CHECK(frame.size() == scene.layers.size(), "a frame has every layer");
      const FloatRows own = frame[i].cast<float>();
      worn.push_back(own.rows() > 0 ? 1 : 0);
      ATELIER_CHECK(own.rows() == 0 || rows == 0 || own.rows() == rows,
                    "a layer has one number of vertices");
      rows = std::max<std::int64_t>(rows, own.rows());
      all.insert(all.end(), own.data(), own.data() + own.size());
    }
    archive.texts["layers_" + std::to_string(i) + "_name"] = layer.name;
    archive.texts["layers_" + std::to_string(i) + "_model"] = layer.model;
    put_array(archive, group_of(i) + "/color",
              tensor_of(std::vector<float>(layer.color.begin(), layer.color.end()), {1, 3}));
    put_array(archive, group_of(i) + "/faces", tensor_of(layer.faces));
    put_array(archive, group_of(i) + "/worn", tensor_of(worn));
    put_array(archive, group_of(i) + "/vertices",
              tensor_of(all, {rows == 0 ? 0 : static_cast<std::int64_t>(all.size()) / (3 * rows),
                              rows, 3}));
  }
  return archive;
}

PaintedScene painted_scene_of(const Archive& archive, const std::string& file) {
  check_units(archive, file);
  const std::size_t layers = layer_count(archive, file);
  check_scene_names(archive, layers, file);
  PaintedScene scene;
  constexpr int kLargestId = 1'000'000'000;
  scene.frame_ids = indices_of(array_at(archive, "frames/id", file), kLargestId, file, "frames/id");
  const std::vector<std::string> ids = texts_at(archive, "cameras/id", file);
  const RowMatrix cameras =
      matrix_of(array_at(archive, "cameras/numbers", file), kNumbers, file, "cameras/numbers");
  const auto frames = static_cast<Index>(scene.frame_ids.size());
  if (frames == 0) {
    throw DataError(file, "frames/id", "no frame", "one or more");
  }
  if (static_cast<Index>(ids.size()) != cameras.rows() ||
      (cameras.rows() != 1 && cameras.rows() != frames)) {
    throw DataError(file, "cameras", std::to_string(cameras.rows()),
                    "one, or one for each of " + std::to_string(frames) + " frames");
  }
  for (Index c = 0; c < cameras.rows(); ++c) {
    scene.cameras.push_back(camera_of(cameras.row(c), ids[static_cast<std::size_t>(c)], file));
  }
  scene.vertices.resize(scene.frame_ids.size());
  for (std::size_t i = 0; i < layers; ++i) {
    const auto text = [&](const char* what) {
      const auto found = archive.texts.find("layers_" + std::to_string(i) + what);
      return found == archive.texts.end() ? std::string() : found->second;
    };
    SceneLayer layer;
    layer.name = text("_name");
    layer.model = text("_model");
    layer.color = color_of(archive, group_of(i) + "/color", file);
    std::vector<Points> vertices = vertices_of(archive, group_of(i), frames, file);
    Index rows = 0;
    for (std::size_t f = 0; f < vertices.size(); ++f) {
      rows = std::max(rows, vertices[f].rows());
      scene.vertices[f].push_back(std::move(vertices[f]));
    }
    // Of a layer that is never worn nobody knows how many vertices it has, and nobody asks.
    constexpr Index kMaxVertices = 1 << 28;
    layer.faces = index_rows_at<Triangles>(archive, group_of(i) + "/faces", 3,
                                           rows > 0 ? rows : kMaxVertices, file);
    scene.layers.push_back(std::move(layer));
  }
  return scene;
}

}  // namespace atelier
