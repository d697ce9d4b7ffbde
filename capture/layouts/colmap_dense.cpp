#include "capture/layouts/colmap_dense.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDepths = "depth_maps";
constexpr const char* kNormals = "normal_maps";
constexpr const char* kConfidences = "confidence_maps";

std::string picture_name(const Camera& camera) {
  return camera.id + ".png";
}

fs::path map_file(const fs::path& folder, const char* kind, const Camera& camera) {
  return folder / "stereo" / kind / (picture_name(camera) + ".geometric.bin");
}

std::string number_line(std::initializer_list<double> values) {
  std::string line;
  for (const double value : values) {
    std::array<char, 40> text{};
    std::snprintf(text.data(), text.size(), " %.17g", value);
    line += text.data();
  }
  return line;
}

/// Normals turned by a rotation.
Image turned(const Image& normals, const Eigen::Matrix3d& rotation) {
  Image result = normals;
  for (std::size_t p = 0; p < result.data.size(); p += 3) {
    const Eigen::Vector3f n =
        rotation.cast<float>() * Eigen::Map<const Eigen::Vector3f>(&normals.data[p]);
    std::copy(n.data(), n.data() + 3, &result.data[p]);
  }
  return result;
}

Image read_map(const fs::path& file, const Camera& camera, int channels, const Limits& limits) {
  if (!fs::exists(file)) {
    throw DataError(file.string(), "camera '" + camera.id + "'", "no such map",
                    "one; atelier depth makes them");
  }
  Image map = parse_colmap_matrix(read_file_bytes(file, limits.image_pixels * 12 + 100),
                                  file.string(), limits);
  if (map.width != camera.width || map.height != camera.height || map.channels != channels) {
    throw DataError(file.string(), "header",
                    std::to_string(map.width) + " x " + std::to_string(map.height) + " x " +
                        std::to_string(map.channels),
                    std::to_string(camera.width) + " x " + std::to_string(camera.height) + " x " +
                        std::to_string(channels) + ", as the camera's images");
  }
  return map;
}

void require_range(const Image& map, const fs::path& file, float low, float high,
                   const char* what) {
  for (std::size_t i = 0; i < map.data.size(); ++i) {
    if (!(map.data[i] >= low && map.data[i] <= high)) {
      throw DataError(file.string(), "value " + std::to_string(i), short_number(map.data[i]), what);
    }
  }
}

}  // namespace

std::string colmap_matrix(const Image& image) {
  std::string text = std::to_string(image.width) + "&" + std::to_string(image.height) + "&" +
                     std::to_string(image.channels) + "&";
  const std::size_t pixels = image.data.size() / static_cast<std::size_t>(image.channels);
  std::vector<float> planes(image.data.size());
  for (std::size_t p = 0; p < pixels; ++p) {
    for (std::size_t c = 0; c < static_cast<std::size_t>(image.channels); ++c) {
      planes[c * pixels + p] = image.data[p * static_cast<std::size_t>(image.channels) + c];
    }
  }
  const std::size_t head = text.size();
  text.resize(head + planes.size() * sizeof(float));
  if (!planes.empty()) {
    std::memcpy(text.data() + head, planes.data(), planes.size() * sizeof(float));
  }
  return text;
}

Image parse_colmap_matrix(std::span<const std::byte> bytes, const std::string& file,
                          const Limits& limits) {
  std::array<std::int64_t, 3> size{};
  std::size_t at = 0;
  for (std::int64_t& value : size) {
    constexpr std::size_t kLongest = 6;
    const std::size_t begin = at;
    while (at < bytes.size() && at - begin < kLongest && std::to_integer<char>(bytes[at]) >= '0' &&
           std::to_integer<char>(bytes[at]) <= '9') {
      value = 10 * value + (std::to_integer<char>(bytes[at]) - '0');
      ++at;
    }
    if (at == begin || at >= bytes.size() || std::to_integer<char>(bytes[at]) != '&') {
      throw DataError(file, "header", "no size", "width&height&channels&");
    }
    ++at;
  }
  const auto [width, height, channels] = size;
  if (width < 1 || height < 1 || (channels != 1 && channels != 3) || width > limits.image_side ||
      height > limits.image_side || width * height > limits.image_pixels) {
    throw DataError(
        file, "header",
        std::to_string(width) + " x " + std::to_string(height) + " x " + std::to_string(channels),
        "1 or 3 channels of at most " + std::to_string(limits.image_pixels) + " pixels");
  }
  const auto count = static_cast<std::size_t>(width * height * channels);
  if (bytes.size() - at != count * sizeof(float)) {
    throw DataError(file, "values", std::to_string(bytes.size() - at) + " bytes",
                    std::to_string(count * sizeof(float)));
  }
  Image image(static_cast<int>(width), static_cast<int>(height), static_cast<int>(channels));
  const auto pixels = static_cast<std::size_t>(width * height);
  for (std::size_t c = 0; c < static_cast<std::size_t>(channels); ++c) {
    for (std::size_t p = 0; p < pixels; ++p) {
      std::memcpy(&image.data[p * static_cast<std::size_t>(channels) + c],
                  bytes.data() + at + (c * pixels + p) * sizeof(float), sizeof(float));
    }
  }
  return image;
}

void write_dense_workspace(const fs::path& folder, const std::vector<Camera>& cameras,
                           const std::vector<Image>& images, const Points& places) {
  ATELIER_CHECK(cameras.size() == images.size(), "an image for each camera");
  for (const char* kind : {"", kDepths, kNormals, kConfidences}) {
    make_private_directory(folder / "stereo" / kind);
  }
  make_private_directory(folder / "images");
  make_private_directory(folder / "sparse");
  std::string intrinsics = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  std::string poses = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n";
  std::string names;
  std::string sources;
  std::vector<std::string> tracks(static_cast<std::size_t>(places.rows()));
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Camera& camera = cameras[i];
    ATELIER_CHECK(camera.distortion_model == Distortion::None, "a camera with distortion");
    const std::string id = std::to_string(i + 1);
    intrinsics += id + " PINHOLE " + std::to_string(camera.width) + " " +
                  std::to_string(camera.height) +
                  number_line({camera.fx, camera.fy, camera.cx, camera.cy}) + "\n";
    const Eigen::Quaterniond q = Eigen::Quaterniond(camera.camera_from_world_rotation).normalized();
    const Eigen::Vector3d& t = camera.camera_from_world_translation;
    poses += id + number_line({q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()});
    poses += " " + id;
    poses += " " + picture_name(camera) + "\n";
    int seen = 0;
    for (Index p = 0; p < places.rows(); ++p) {
      const auto pixel = project(camera, places.row(p).transpose());
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= camera.width ||
          pixel->y() >= camera.height) {
        continue;
      }
      poses += seen > 0 ? " " : "";
      poses += number_line({pixel->x(), pixel->y()}).substr(1);
      poses += " ";
      poses += std::to_string(p + 1);
      std::string& track = tracks[static_cast<std::size_t>(p)];
      track += " " + id;
      track += " " + std::to_string(seen++);
    }
    poses += "\n";
    names += picture_name(camera) + "\n";
    sources += picture_name(camera) + "\n__auto__, 20\n";
    Image light = images[i];
    for (float& value : light.data) {
      value = std::clamp(value, 0.0F, 1.0F);
    }
    write_image(folder / "images" / picture_name(camera), light);
  }
  write_file_atomically(folder / "sparse" / "cameras.txt", intrinsics);
  write_file_atomically(folder / "sparse" / "images.txt", poses);
  std::string points =
      "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  for (Index p = 0; p < places.rows(); ++p) {
    points += std::to_string(p + 1) + number_line({places(p, 0), places(p, 1), places(p, 2)}) +
              " 128 128 128 1" + tracks[static_cast<std::size_t>(p)] + "\n";
  }
  write_file_atomically(folder / "sparse" / "points3D.txt", points);
  write_file_atomically(folder / "stereo" / "fusion.cfg", names);
  write_file_atomically(folder / "stereo" / "patch-match.cfg", sources);
}

void write_depth_map(const fs::path& folder, const DepthMap& map) {
  write_file_atomically(map_file(folder, kDepths, map.camera), colmap_matrix(map.depth));
  write_file_atomically(map_file(folder, kNormals, map.camera),
                        colmap_matrix(turned(map.normal, map.camera.camera_from_world_rotation)));
  write_file_atomically(map_file(folder, kConfidences, map.camera), colmap_matrix(map.confidence));
}

bool has_depth_map(const fs::path& folder, const Camera& camera) {
  // Confidence is written last.
  return fs::exists(map_file(folder, kConfidences, camera));
}

DepthMap read_depth_map(const fs::path& folder, const Camera& camera, const Limits& limits) {
  DepthMap map;
  map.camera = camera;
  const fs::path depths = map_file(folder, kDepths, camera);
  map.depth = read_map(depths, camera, 1, limits);
  require_range(map.depth, depths, 0, 1e6F, "0 or metres");
  const fs::path normals = map_file(folder, kNormals, camera);
  const Image in_camera = read_map(normals, camera, 3, limits);
  require_range(in_camera, normals, -1.001F, 1.001F, "parts of unit normals");
  map.normal = turned(in_camera, camera.camera_from_world_rotation.transpose());
  const fs::path confidences = map_file(folder, kConfidences, camera);
  map.confidence = read_map(confidences, camera, 1, limits);
  require_range(map.confidence, confidences, 0, 1, "0 to 1");
  return map;
}

}  // namespace atelier
