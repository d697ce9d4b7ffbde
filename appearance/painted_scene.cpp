#include "appearance/painted_scene.h"

#include <algorithm>

#include "core/archive_arrays.h"
#include "core/error.h"

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
  const bool fits = row[0] >= 1 && row[0] <= kLargestSide && row[1] >= 1 &&
                    row[1] <= kLargestSide && row[6] >= 0 && row[6] <= 2;
  if (!fits) {
    throw DataError(file, "cameras", "a size or lens that no camera has", "1 to 32768 pixels");
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

}  // namespace

OptionTable describe(PaintOptions& options) {
  OptionTable table;
  table.add("samples", options.samples, 1, 8, "",
            "A side of a pixel: its square are averaged; 1 is quickest");
  table.add("alpha", options.alpha, "A fourth channel with the coverage instead of a background");
  table.add("background", options.background, 0, 1, "", "Linear red, green and blue");
  table.add("occlusion", describe(options.occlusion));
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
  PaintedScene scene;
  constexpr int kLargestId = 1'000'000'000;
  scene.frame_ids = indices_of(array_at(archive, "frames/id", file), kLargestId, file, "frames/id");
  const std::vector<std::string> ids = texts_at(archive, "cameras/id", file);
  const RowMatrix cameras =
      matrix_of(array_at(archive, "cameras/numbers", file), kNumbers, file, "cameras/numbers");
  const auto frames = static_cast<Index>(scene.frame_ids.size());
  if (static_cast<Index>(ids.size()) != cameras.rows() ||
      (cameras.rows() != 1 && cameras.rows() != frames)) {
    throw DataError(file, "cameras", std::to_string(cameras.rows()),
                    "one, or one for each of " + std::to_string(frames) + " frames");
  }
  for (Index c = 0; c < cameras.rows(); ++c) {
    scene.cameras.push_back(camera_of(cameras.row(c), ids[static_cast<std::size_t>(c)], file));
  }
  const auto count = archive.numbers.find("layers");
  constexpr double kMostLayers = 1000;
  if (count == archive.numbers.end() || !(count->second >= 1 && count->second <= kMostLayers)) {
    throw DataError(file, "layers", "no number", "1 to 1000");
  }
  scene.vertices.resize(scene.frame_ids.size());
  for (std::size_t i = 0; i < static_cast<std::size_t>(count->second); ++i) {
    const auto text = [&](const char* what) {
      const auto found = archive.texts.find("layers_" + std::to_string(i) + what);
      return found == archive.texts.end() ? std::string() : found->second;
    };
    SceneLayer layer;
    layer.name = text("_name");
    layer.model = text("_model");
    layer.color = rows_at<FloatRows>(archive, group_of(i) + "/color", 3, 1, file).row(0);
    const Tensor* vertices = find_array(archive, group_of(i) + "/vertices");
    const std::int64_t rows =
        vertices != nullptr && vertices->shape.size() == 3 ? vertices->shape[1] : 0;
    layer.faces = index_rows_at<Triangles>(archive, group_of(i) + "/faces", 3,
                                           std::max<std::int64_t>(rows, 1), file);
    const std::vector<int> worn =
        indices_of(array_at(archive, group_of(i) + "/worn", file), 2, file, group_of(i) + "/worn");
    const auto times = std::count(worn.begin(), worn.end(), 1);
    if (static_cast<Index>(worn.size()) != frames ||
        (times > 0 && (vertices == nullptr || vertices->type != ElementType::Float32 ||
                       vertices->shape != std::vector<std::int64_t>{times, rows, 3}))) {
      throw DataError(file, group_of(i) + "/vertices", "another shape",
                      "float32, three a vertex in each frame where it is worn");
    }
    if (times > 0) {
      check_finite(*vertices, file, group_of(i) + "/vertices");
    }
    Index at = 0;
    for (std::size_t f = 0; f < worn.size(); ++f) {
      Points own(0, 3);
      if (worn[f] != 0) {
        own =
            Eigen::Map<const FloatRows>(values_of<float>(*vertices).data() + 3 * rows * at, rows, 3)
                .cast<double>();
        ++at;
      }
      scene.vertices[f].push_back(std::move(own));
    }
    scene.layers.push_back(std::move(layer));
  }
  return scene;
}

}  // namespace atelier
