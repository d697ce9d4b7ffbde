#include "appearance/appearance_data.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/archive_arrays.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr const char* kSchema = "atelier.appearance_data";
using Rows3f = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Rows of all frames, one under the other, as [N,rows,3].
template <class Get>
Tensor stacked(const AppearanceData& data, Index rows, const Get& get) {
  std::vector<float> all;
  all.reserve(data.frames.size() * static_cast<std::size_t>(3 * rows));
  for (const FrameMaps& frame : data.frames) {
    const Rows3f& one = get(frame);
    all.insert(all.end(), one.data(), one.data() + one.size());
  }
  return tensor_of(all, {static_cast<std::int64_t>(data.frames.size()), rows, 3});
}

/// A tensor of floats of this very shape, each in [low, high].
std::span<const float> floats_at(const Archive& archive, const std::string& name,
                                 const std::vector<std::int64_t>& shape, float low, float high,
                                 const std::string& file) {
  const Tensor& tensor = array_at(archive, name, file);
  if (tensor.type != ElementType::Float32 || tensor.shape != shape) {
    throw DataError(file, name,
                    std::string(element_type_name(tensor.type)) + " " + shape_text(tensor.shape),
                    "float32 " + shape_text(shape));
  }
  const std::span<const float> values = values_of<float>(tensor);
  for (const float value : values) {
    if (!(value >= low && value <= high)) {
      throw DataError(file, name, std::to_string(value),
                      std::to_string(low) + " to " + std::to_string(high));
    }
  }
  return values;
}

int side_at(const Archive& archive, const std::string& name, const std::string& file) {
  const auto found = archive.numbers.find(name);
  constexpr double kLargest = 8192;
  if (found == archive.numbers.end() || !(found->second >= 4 && found->second <= kLargest) ||
      found->second != std::floor(found->second)) {
    throw DataError(file, name, found == archive.numbers.end() ? "nothing" : "no size",
                    "4 to 8192 texels");
  }
  return static_cast<int>(found->second);
}

void read_frames(AppearanceData& data, const Archive& archive, const std::string& file) {
  constexpr float kFar = 1e6F;
  constexpr float kUnit = 1.001F;
  constexpr int kLargestId = 1'000'000'000;
  const std::vector<int> ids =
      indices_of(array_at(archive, "frames/id", file), kLargestId, file, "frames/id");
  const auto count = static_cast<std::int64_t>(ids.size());
  const auto texels = static_cast<std::int64_t>(texture_texels(data).covered.size());
  const auto shadow = static_cast<std::int64_t>(shadow_texels(data).covered.size());
  const auto position =
      floats_at(archive, "frames/position", {count, texels, 3}, -kFar, kFar, file);
  const auto normal = floats_at(archive, "frames/normal", {count, texels, 3}, -kUnit, kUnit, file);
  const auto tangent =
      floats_at(archive, "frames/tangent", {count, texels, 3}, -kUnit, kUnit, file);
  const auto visibility = floats_at(archive, "frames/visibility", {count, shadow}, 0, 1, file);
  for (std::int64_t i = 0; i < count; ++i) {
    FrameMaps frame;
    frame.frame_id = ids[static_cast<std::size_t>(i)];
    const auto rows = [&](std::span<const float> all) {
      return Rows3f(Eigen::Map<const Rows3f>(all.data() + 3 * i * texels, texels, 3));
    };
    frame.geometry = {rows(position), rows(normal), rows(tangent)};
    frame.visibility = Eigen::Map<const Eigen::VectorXf>(visibility.data() + i * shadow, shadow);
    data.frames.push_back(std::move(frame));
  }
}

void read_views(AppearanceData& data, const Archive& archive, const std::string& file) {
  const Tensor* of_camera = find_array(archive, "views/camera");
  if (of_camera == nullptr) {
    return;
  }
  const std::vector<int> cameras =
      indices_of(*of_camera, static_cast<Index>(data.camera_ids.size()), file, "views/camera");
  const std::vector<int> frames =
      indices_of(array_at(archive, "views/frame", file), static_cast<Index>(data.frames.size()),
                 file, "views/frame");
  const std::vector<std::int64_t> begins =
      integers_of(array_at(archive, "views/begin", file), file, "views/begin");
  const Tensor* pixels = find_array(archive, "pixels/u");
  const auto total = pixels == nullptr ? 0 : element_count(*pixels);
  if (frames.size() != cameras.size() || begins.size() != cameras.size() + 1 ||
      !std::is_sorted(begins.begin(), begins.end()) || begins.front() != 0 ||
      begins.back() != total) {
    throw DataError(file, "views", "arrays that do not agree",
                    "camera, frame and the first pixel of each view");
  }
  std::span<const float> u;
  std::span<const float> v;
  std::vector<int> places;
  std::span<const std::uint8_t> colors;
  if (total > 0) {
    u = floats_at(archive, "pixels/u", {total}, 0, 1, file);
    v = floats_at(archive, "pixels/v", {total}, 0, 1, file);
    places = indices_of(array_at(archive, "pixels/place", file), 1 << 30, file, "pixels/place");
    if (const Tensor* found = find_array(archive, "pixels/color")) {
      if (found->type != ElementType::UInt8 ||
          found->shape != std::vector<std::int64_t>{total, 3}) {
        throw DataError(file, "pixels/color", shape_text(found->shape), "uint8, one row a pixel");
      }
      colors = values_of<std::uint8_t>(*found);
    }
    if (static_cast<std::int64_t>(places.size()) != total) {
      throw DataError(file, "pixels/place", std::to_string(places.size()), std::to_string(total));
    }
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const auto begin = begins[i];
    const auto end = begins[i + 1];
    AppearanceView view{cameras[i],
                        frames[i],
                        {places.begin() + begin, places.begin() + end},
                        {u.begin() + begin, u.begin() + end},
                        {v.begin() + begin, v.begin() + end},
                        {}};
    if (!colors.empty()) {
      view.colors.assign(colors.begin() + 3 * begin, colors.begin() + 3 * end);
    }
    data.views.push_back(std::move(view));
  }
}

}  // namespace

TexelMap texture_texels(const AppearanceData& data) {
  return texel_map(data.faces, data.uvs, data.uv_faces, data.resolution);
}

TexelMap shadow_texels(const AppearanceData& data) {
  return texel_map(data.faces, data.uvs, data.uv_faces, data.shadow_resolution);
}

TexturePixels texture_pixels(const AppearanceView& view) {
  static const std::array<float, 256> kLinear = [] {
    ByteImage ramp(256, 1, 1);
    for (int i = 0; i < 256; ++i) {
      ramp.data[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(i);
    }
    const Image linear = linear_from_srgb(ramp);
    std::array<float, 256> table{};
    std::copy(linear.data.begin(), linear.data.end(), table.begin());
    return table;
  }();
  TexturePixels pixels{view.u, view.v, {}};
  pixels.colors.reserve(view.colors.size());
  for (const std::uint8_t byte : view.colors) {
    pixels.colors.push_back(kLinear[byte]);
  }
  return pixels;
}

void check_appearance_data(const AppearanceData& data, const std::string& file) {
  const auto refuse = [&](const std::string& where, const std::string& found,
                          const std::string& expected) {
    throw DataError(file, where, found, expected);
  };
  const std::size_t cameras = data.camera_ids.size();
  if (data.centers.rows() != static_cast<Index>(cameras) || data.widths.size() != cameras ||
      data.heights.size() != cameras || !data.centers.allFinite()) {
    refuse("cameras", "centres or sizes of other cameras", "one for each");
  }
  const auto texels = static_cast<Index>(texture_texels(data).covered.size());
  const auto shadow = static_cast<Index>(shadow_texels(data).covered.size());
  for (const FrameMaps& frame : data.frames) {
    const GeometryMaps& maps = frame.geometry;
    if (maps.position.rows() != texels || maps.normal.rows() != texels ||
        maps.tangent.rows() != texels || frame.visibility.size() != shadow ||
        !maps.position.allFinite() || !maps.normal.allFinite() || !maps.tangent.allFinite() ||
        !frame.visibility.allFinite()) {
      refuse("frame " + std::to_string(frame.frame_id), "maps that do not fit the texture",
             std::to_string(texels) + " finite rows");
    }
  }
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    const AppearanceView& view = data.views[i];
    const std::size_t count = view.pixel.size();
    const bool named = view.camera_idx >= 0 && view.camera_idx < static_cast<int>(cameras) &&
                       view.frame_idx >= 0 && view.frame_idx < static_cast<int>(data.frames.size());
    if (!named || view.u.size() != count || view.v.size() != count ||
        (!view.colors.empty() && view.colors.size() != 3 * count)) {
      refuse("view " + std::to_string(i), "arrays that do not agree", "one row for each pixel");
    }
    const int places = data.widths[static_cast<std::size_t>(view.camera_idx)] *
                       data.heights[static_cast<std::size_t>(view.camera_idx)];
    for (const int place : view.pixel) {
      if (place < 0 || place >= places) {
        refuse("view " + std::to_string(i), "a pixel outside of the picture", "y * width + x");
      }
    }
  }
}

Archive archive_of(const AppearanceData& data) {
  check_appearance_data(data);
  Archive archive;
  archive.schema = kSchema;
  archive.texts["name"] = data.name;
  archive.numbers["resolution"] = data.resolution;
  archive.numbers["shadow_resolution"] = data.shadow_resolution;
  put_array(archive, "atlas/faces", tensor_of(data.faces));
  put_array(archive, "atlas/uvs", tensor_of(data.uvs));
  put_array(archive, "atlas/uv_faces", tensor_of(data.uv_faces));
  put_array(archive, "cameras/id", tensor_of_texts(data.camera_ids));
  put_array(archive, "cameras/center", tensor_of(data.centers));
  put_array(archive, "cameras/width", tensor_of(data.widths));
  put_array(archive, "cameras/height", tensor_of(data.heights));
  std::vector<int> ids;
  std::vector<float> visibility;
  for (const FrameMaps& frame : data.frames) {
    ids.push_back(frame.frame_id);
    visibility.insert(visibility.end(), frame.visibility.begin(), frame.visibility.end());
  }
  if (!data.frames.empty()) {
    const auto count = static_cast<std::int64_t>(data.frames.size());
    const Index texels = data.frames[0].geometry.position.rows();
    put_array(archive, "frames/id", tensor_of(ids));
    put_array(archive, "frames/position",
              stacked(data, texels,
                      [](const FrameMaps& f) -> const Rows3f& { return f.geometry.position; }));
    put_array(archive, "frames/normal",
              stacked(data, texels,
                      [](const FrameMaps& f) -> const Rows3f& { return f.geometry.normal; }));
    put_array(archive, "frames/tangent",
              stacked(data, texels,
                      [](const FrameMaps& f) -> const Rows3f& { return f.geometry.tangent; }));
    put_array(archive, "frames/visibility",
              tensor_of(visibility, {count, data.frames[0].visibility.size()}));
  }
  std::vector<int> cameras;
  std::vector<int> frames;
  std::vector<std::int64_t> begins = {0};
  std::vector<int> places;
  std::vector<float> u;
  std::vector<float> v;
  std::vector<std::uint8_t> colors;
  for (const AppearanceView& view : data.views) {
    cameras.push_back(view.camera_idx);
    frames.push_back(view.frame_idx);
    begins.push_back(begins.back() + static_cast<std::int64_t>(view.pixel.size()));
    places.insert(places.end(), view.pixel.begin(), view.pixel.end());
    u.insert(u.end(), view.u.begin(), view.u.end());
    v.insert(v.end(), view.v.begin(), view.v.end());
    colors.insert(colors.end(), view.colors.begin(), view.colors.end());
  }
  if (!colors.empty() && colors.size() != 3 * u.size()) {
    throw DataError("", "views", "some with colours and some without", "all or none");
  }
  put_array(archive, "views/camera", tensor_of(cameras));
  put_array(archive, "views/frame", tensor_of(frames));
  put_array(archive, "views/begin", tensor_of(begins));
  put_array(archive, "pixels/place", tensor_of(places));
  put_array(archive, "pixels/u", tensor_of(u));
  put_array(archive, "pixels/v", tensor_of(v));
  const auto count = static_cast<std::int64_t>(colors.size() / 3);
  put_array(archive, "pixels/color", tensor_of(colors, {count, 3}));
  return archive;
}

AppearanceData appearance_data_of(const Archive& archive, const std::string& file) {
  AppearanceData data;
  const auto name = archive.texts.find("name");
  data.name = name == archive.texts.end() ? "" : name->second;
  data.resolution = side_at(archive, "resolution", file);
  data.shadow_resolution = side_at(archive, "shadow_resolution", file);
  constexpr Index kMostVertices = 1 << 28;
  data.uvs = rows_at<Points2>(archive, "atlas/uvs", 2, -1, file);
  data.faces = index_rows_at<Triangles>(archive, "atlas/faces", 3, kMostVertices, file);
  data.uv_faces = index_rows_at<Triangles>(archive, "atlas/uv_faces", 3, data.uvs.rows(), file);
  if (data.faces.rows() != data.uv_faces.rows() || data.faces.rows() == 0) {
    throw DataError(file, "atlas", std::to_string(data.uv_faces.rows()) + " texture faces",
                    std::to_string(data.faces.rows()) + ", more than 0");
  }
  data.camera_ids = texts_at(archive, "cameras/id", file);
  const auto cameras = static_cast<Index>(data.camera_ids.size());
  data.centers = rows_at<Points>(archive, "cameras/center", 3, cameras, file);
  constexpr Index kLargestSide = 32'769;
  data.widths =
      indices_of(array_at(archive, "cameras/width", file), kLargestSide, file, "cameras/width");
  data.heights =
      indices_of(array_at(archive, "cameras/height", file), kLargestSide, file, "cameras/height");
  read_frames(data, archive, file);
  read_views(data, archive, file);
  check_appearance_data(data, file);
  return data;
}

AppearanceData read_appearance_data(const std::filesystem::path& path, const Limits& limits) {
  return appearance_data_of(read_archive(path, kSchema, 1, limits), path.string());
}

}  // namespace atelier
