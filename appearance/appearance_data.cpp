#include "appearance/appearance_data.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "appearance/learnt_occlusion.h"
#include "appearance/texel_map.h"
#include "core/archive_arrays.h"
#include "core/error.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr const char* kSchema = "atelier.appearance_data";
constexpr int kDataVersion = 2;
constexpr float kSteps = 65535;  // of a texture coordinate in a file
constexpr float kFar = 1e6F;     // m

bool is_appearance_array(const std::string& dataset) {
  static const std::vector<std::string> names = {
      "atlas/faces",     "atlas/uv_faces", "atlas/uvs",      "body/parent",    "body/part",
      "body/rest",       "frames/offset",  "frames/support", "cameras/center", "cameras/height",
      "cameras/id",      "cameras/width",  "frames/face",    "frames/id",      "frames/position",
      "frames/transfer", "pixels/color",   "pixels/place",   "pixels/uv",      "views/begin",
      "views/camera",    "views/frame"};
  return std::find(names.begin(), names.end(), dataset) != names.end();
}

/// Every frame has a tangent for each texture coordinate, made of all faces. Vertices are what a
/// file pays for in each frame: no surface has so many more of the others.
void check_counts(const AppearanceData& data, std::int64_t vertices, const std::string& file) {
  constexpr std::int64_t kMaxFaces = 8;
  if (data.faces.rows() > kMaxFaces * vertices) {
    throw DataError(file, "atlas/faces", std::to_string(data.faces.rows()) + " faces",
                    "at most 8 for each of " + std::to_string(vertices) + " vertices");
  }
  if (data.uvs.rows() > 3 * data.faces.rows()) {
    throw DataError(file, "atlas/uvs", std::to_string(data.uvs.rows()) + " texture coordinates",
                    "at most 3 for each of " + std::to_string(data.faces.rows()) + " faces");
  }
}

/// Floats of this very shape, each in [low, high].
std::span<const float> floats_within(const Archive& archive, const std::string& name,
                                     const std::vector<std::int64_t>& shape, float low, float high,
                                     const std::string& file) {
  const std::span<const float> values = floats_at(archive, name, shape, file);
  for (const float value : values) {
    if (!(value >= low && value <= high)) {
      throw DataError(file, name, std::to_string(value),
                      std::to_string(low) + " to " + std::to_string(high));
    }
  }
  return values;
}

void read_frames(AppearanceData& data, const Archive& archive, const std::string& file) {
  constexpr int kLargestId = 1'000'000'000;
  const std::vector<int> ids =
      indices_of(array_at(archive, "frames/id", file), kLargestId, file, "frames/id");
  const Tensor& position = array_at(archive, "frames/position", file);
  const auto count = static_cast<std::int64_t>(ids.size());
  if (count == 0) {
    throw DataError(file, "frames/id", "no frame", "one or more");
  }
  const std::int64_t vertices = position.shape.size() == 3 ? position.shape[1] : 0;
  const auto places =
      floats_within(archive, "frames/position", {count, vertices, 3}, -kFar, kFar, file);
  // No harmonic of these is further from 0 than the root of 5.
  constexpr float kMost = 2.25F;
  const auto transfer = floats_within(archive, "frames/transfer",
                                      {count, vertices, 2, kTransferTerms}, -kMost, kMost, file);
  for (std::size_t i = 0; i < transfer.size(); i += kTransferTerms) {
    if (!(transfer[i] >= 0 && transfer[i] <= 1)) {
      throw DataError(file, "frames/transfer", short_number(transfer[i], 7) + " of degree 0",
                      "0 to 1, the share of the hemisphere that is open");
    }
  }
  if (data.faces.maxCoeff() >= vertices) {
    throw DataError(file, "atlas/faces", "vertex " + std::to_string(data.faces.maxCoeff()),
                    "below " + std::to_string(vertices) + ", as frames/position has them");
  }
  check_counts(data, vertices, file);
  for (std::int64_t i = 0; i < count; ++i) {
    const Points own =
        Eigen::Map<const FloatRows>(places.data() + 3 * i * vertices, vertices, 3).cast<double>();
    SurfaceFrame frame =
        surface_frame(own, data.faces, data.uvs, data.uv_faces, ids[static_cast<std::size_t>(i)]);
    constexpr int kColumns = 2 * kTransferTerms;
    frame.transfer = Eigen::Map<const TransferRows>(transfer.data() + kColumns * i * vertices,
                                                    vertices, kColumns);
    data.frames.push_back(std::move(frame));
  }
}

void read_faces(AppearanceData& data, const Archive& archive, const std::string& file) {
  const Tensor* found = find_array(archive, "frames/face");
  if (found == nullptr) {
    return;
  }
  constexpr float kFarOff = 100;  // cm
  const auto frames = static_cast<std::int64_t>(data.frames.size());
  const std::int64_t numbers = found->shape.size() == 2 ? found->shape[1] : 0;
  const auto values =
      floats_within(archive, "frames/face", {frames, numbers}, -kFarOff, kFarOff, file);
  for (std::int64_t i = 0; i < frames; ++i) {
    const std::span<const float> own =
        values.subspan(static_cast<std::size_t>(i * numbers), static_cast<std::size_t>(numbers));
    data.frames[static_cast<std::size_t>(i)].face.assign(own.begin(), own.end());
  }
}

void put_faces(Archive& archive, const AppearanceData& data) {
  std::vector<float> faces;
  for (const SurfaceFrame& frame : data.frames) {
    faces.insert(faces.end(), frame.face.begin(), frame.face.end());
  }
  const auto frames = static_cast<std::int64_t>(data.frames.size());
  if (!faces.empty()) {
    put_array(archive, "frames/face",
              tensor_of(faces, {frames, static_cast<std::int64_t>(faces.size()) / frames}));
  }
}

/// Every frame has the same points of the face, which are those of the body's parts.
void check_faces(const AppearanceData& data, const std::string& file) {
  for (const SurfaceFrame& frame : data.frames) {
    const std::size_t numbers = frame.face.size();
    const std::size_t expected = data.body
                                     ? 3 * static_cast<std::size_t>(face_points(data.body->parts))
                                     : data.frames[0].face.size();
    if ((numbers != expected && numbers > 0) || numbers != data.frames[0].face.size()) {
      throw DataError(file, "frames/face", std::to_string(numbers) + " numbers of a frame",
                      std::to_string(expected) + ", three for each point of the face");
    }
  }
}

void read_body(AppearanceData& data, const Archive& archive, const std::string& file) {
  if (find_array(archive, "body/part") == nullptr) {
    return;
  }
  constexpr Index kMaxParts = 1000;
  constexpr float kFarOff = 1;  // m off the mean surface
  const auto frames = static_cast<std::int64_t>(data.frames.size());
  const std::int64_t vertices = data.frames[0].position.rows();
  BodyShapes body;
  body.parts.parents =
      indices_of(array_at(archive, "body/parent", file), kMaxParts, file, "body/parent");
  body.parts.part = indices_of(array_at(archive, "body/part", file),
                               static_cast<Index>(body.parts.parents.size()), file, "body/part");
  const auto rest = floats_within(archive, "body/rest", {vertices, 3}, -kFar, kFar, file);
  body.parts.rest = Eigen::Map<const FloatRows>(rest.data(), vertices, 3);
  check_body_parts(body.parts, file);
  const auto offset =
      floats_within(archive, "frames/offset", {frames, vertices, 3}, -kFarOff, kFarOff, file);
  const auto support = floats_within(archive, "frames/support", {frames, vertices}, 0, 1, file);
  for (std::int64_t i = 0; i < frames; ++i) {
    body.offset.emplace_back(
        Eigen::Map<const FloatRows>(offset.data() + 3 * i * vertices, vertices, 3));
    body.support.emplace_back(
        Eigen::Map<const Eigen::VectorXf>(support.data() + i * vertices, vertices));
  }
  data.body = std::move(body);
}

void put_body(Archive& archive, const BodyShapes& body) {
  const auto frames = static_cast<std::int64_t>(body.offset.size());
  const std::int64_t vertices = body.parts.rest.rows();
  std::vector<float> offset;
  std::vector<float> support;
  for (std::size_t i = 0; i < body.offset.size(); ++i) {
    offset.insert(offset.end(), body.offset[i].data(),
                  body.offset[i].data() + body.offset[i].size());
    support.insert(support.end(), body.support[i].begin(), body.support[i].end());
  }
  put_array(archive, "body/parent", tensor_of(body.parts.parents));
  put_array(archive, "body/part", tensor_of(body.parts.part));
  put_array(archive, "body/rest", tensor_of(body.parts.rest));
  put_array(archive, "frames/offset", tensor_of(offset, {frames, vertices, 3}));
  put_array(archive, "frames/support", tensor_of(support, {frames, vertices}));
}

void check_body(const AppearanceData& data, const std::string& file) {
  const BodyShapes& body = *data.body;
  check_body_parts(body.parts, file);
  bool fits = body.offset.size() == data.frames.size() && body.support.size() == data.frames.size();
  for (std::size_t i = 0; fits && i < data.frames.size(); ++i) {
    const Index vertices = data.frames[i].position.rows();
    fits = body.parts.rest.rows() == vertices && body.offset[i].rows() == vertices &&
           body.support[i].rows() == vertices && body.offset[i].allFinite() &&
           body.support[i].allFinite();
  }
  if (!fits) {
    throw DataError(file, "body", "arrays that do not fit the surface",
                    "a finite row for each vertex of each frame");
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
  const Tensor* coordinates = find_array(archive, "pixels/uv");
  const std::int64_t total = coordinates == nullptr ? 0 : element_count(*coordinates) / 2;
  if (frames.size() != cameras.size() || begins.size() != cameras.size() + 1 ||
      !std::is_sorted(begins.begin(), begins.end()) || begins.front() != 0 ||
      begins.back() != total) {
    throw DataError(file, "views", "arrays that do not agree",
                    "camera, frame and the first pixel of each view");
  }
  std::span<const std::uint16_t> uvs;
  std::vector<int> places;
  std::span<const std::uint8_t> colors;
  if (total > 0) {
    if (coordinates->type != ElementType::UInt16 ||
        coordinates->shape != std::vector<std::int64_t>{total, 2}) {
      throw DataError(file, "pixels/uv", shape_text(coordinates->shape), "uint16, two a pixel");
    }
    uvs = values_of<std::uint16_t>(*coordinates);
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
    AppearanceView view;
    view.camera_idx = cameras[i];
    view.frame_idx = frames[i];
    view.pixel.assign(places.begin() + begin, places.begin() + end);
    for (auto p = static_cast<std::size_t>(begin); p < static_cast<std::size_t>(end); ++p) {
      view.u.push_back(static_cast<float>(uvs[2 * p]) / kSteps);
      view.v.push_back(static_cast<float>(uvs[2 * p + 1]) / kSteps);
    }
    if (!colors.empty()) {
      view.colors.assign(colors.begin() + 3 * begin, colors.begin() + 3 * end);
    }
    data.views.push_back(std::move(view));
  }
}

}  // namespace

TexturePixels texture_pixels(const AppearanceView& view) {
  static const std::array<float, 256> linear_of_byte = [] {
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
    pixels.colors.push_back(linear_of_byte[byte]);
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
  check_atlas(data.uvs, file);
  for (const SurfaceFrame& frame : data.frames) {
    if (frame.position.rows() != data.frames[0].position.rows() ||
        data.faces.maxCoeff() >= frame.position.rows() ||
        frame.normal.rows() != frame.position.rows() || frame.tangent.rows() != data.uvs.rows() ||
        frame.transfer.rows() != frame.position.rows() || !frame.position.allFinite() ||
        !frame.transfer.allFinite()) {
      refuse("frame " + std::to_string(frame.frame_id), "arrays that do not fit the surface",
             "a finite row for each vertex");
    }
  }
  if (data.body) {
    check_body(data, file);
  }
  check_faces(data, file);
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
    const auto outside = [](float x) { return !(x >= 0 && x <= 1); };
    if (std::any_of(view.u.begin(), view.u.end(), outside) ||
        std::any_of(view.v.begin(), view.v.end(), outside)) {
      refuse("view " + std::to_string(i), "texture coordinates outside of [0, 1]", "an atlas");
    }
    for (const int place : view.pixel) {
      if (place < 0 || place >= places) {
        refuse("view " + std::to_string(i), "a pixel outside of the image", "y * width + x");
      }
    }
  }
}

Archive archive_of(const AppearanceData& data) {
  check_appearance_data(data);
  Archive archive;
  archive.schema = kSchema;
  archive.version = kDataVersion;
  archive.texts["name"] = data.name;
  put_occlusion(archive.texts, data.occlusion);
  put_array(archive, "atlas/faces", tensor_of(data.faces));
  put_array(archive, "atlas/uvs", tensor_of(data.uvs));
  put_array(archive, "atlas/uv_faces", tensor_of(data.uv_faces));
  put_array(archive, "cameras/id", tensor_of_texts(data.camera_ids));
  put_array(archive, "cameras/center", tensor_of(data.centers));
  put_array(archive, "cameras/width", tensor_of(data.widths));
  put_array(archive, "cameras/height", tensor_of(data.heights));
  std::vector<int> ids;
  std::vector<float> position;
  std::vector<float> transfer;
  for (const SurfaceFrame& frame : data.frames) {
    ids.push_back(frame.frame_id);
    position.insert(position.end(), frame.position.data(),
                    frame.position.data() + frame.position.size());
    transfer.insert(transfer.end(), frame.transfer.data(),
                    frame.transfer.data() + frame.transfer.size());
  }
  if (!data.frames.empty()) {
    const auto count = static_cast<std::int64_t>(data.frames.size());
    const std::int64_t vertices = data.frames[0].position.rows();
    put_array(archive, "frames/id", tensor_of(ids));
    put_array(archive, "frames/position", tensor_of(position, {count, vertices, 3}));
    put_array(archive, "frames/transfer",
              tensor_of(transfer, {count, vertices, 2, kTransferTerms}));
  }
  put_faces(archive, data);
  if (data.body) {
    put_body(archive, *data.body);
  }
  std::vector<int> cameras;
  std::vector<int> frames;
  std::vector<std::int64_t> begins = {0};
  std::vector<int> places;
  std::vector<std::uint16_t> uvs;
  std::vector<std::uint8_t> colors;
  for (const AppearanceView& view : data.views) {
    cameras.push_back(view.camera_idx);
    frames.push_back(view.frame_idx);
    begins.push_back(begins.back() + static_cast<std::int64_t>(view.pixel.size()));
    places.insert(places.end(), view.pixel.begin(), view.pixel.end());
    for (std::size_t p = 0; p < view.u.size(); ++p) {
      uvs.push_back(saturating_cast<std::uint16_t>(std::round(view.u[p] * kSteps)));
      uvs.push_back(saturating_cast<std::uint16_t>(std::round(view.v[p] * kSteps)));
    }
    colors.insert(colors.end(), view.colors.begin(), view.colors.end());
  }
  if (!colors.empty() && colors.size() != 3 * places.size()) {
    throw DataError("", "views", "some with colours and some without", "all or none");
  }
  put_array(archive, "views/camera", tensor_of(cameras));
  put_array(archive, "views/frame", tensor_of(frames));
  put_array(archive, "views/begin", tensor_of(begins));
  put_array(archive, "pixels/place", tensor_of(places));
  put_array(archive, "pixels/uv", tensor_of(uvs, {static_cast<std::int64_t>(places.size()), 2}));
  put_array(archive, "pixels/color",
            tensor_of(colors, {static_cast<std::int64_t>(colors.size() / 3), 3}));
  return archive;
}

AppearanceData appearance_data_of(const Archive& archive, const std::string& file) {
  if (archive.version != kDataVersion) {
    throw DataError(file, "version", std::to_string(archive.version),
                    std::to_string(kDataVersion) +
                        ", as this program's 'atelier appearance' makes them; run it again");
  }
  check_units(archive, file);
  check_names(archive, file, is_appearance_array);
  AppearanceData data;
  const auto name = archive.texts.find("name");
  data.name = name == archive.texts.end() ? "" : name->second;
  data.occlusion = occlusion_at(archive.texts, file);
  constexpr Index kMaxVertices = 1 << 28;
  data.uvs = rows_at<Points2>(archive, "atlas/uvs", 2, -1, file);
  data.faces = index_rows_at<Triangles>(archive, "atlas/faces", 3, kMaxVertices, file);
  data.uv_faces = index_rows_at<Triangles>(archive, "atlas/uv_faces", 3, data.uvs.rows(), file);
  if (data.faces.rows() != data.uv_faces.rows() || data.faces.rows() == 0) {
    throw DataError(file, "atlas", std::to_string(data.uv_faces.rows()) + " texture faces",
                    std::to_string(data.faces.rows()) + ", more than 0");
  }
  data.camera_ids = texts_at(archive, "cameras/id", file);
  const auto cameras = static_cast<Index>(data.camera_ids.size());
  data.centers = rows_at<Points>(archive, "cameras/center", 3, cameras, file);
  if (data.centers.size() > 0 && data.centers.cwiseAbs().maxCoeff() > kFar) {
    throw DataError(file, "cameras/center", "a camera more than 1000 km away", "metres");
  }
  constexpr Index kLargestSide = 32'769;
  data.widths =
      indices_of(array_at(archive, "cameras/width", file), kLargestSide, file, "cameras/width");
  data.heights =
      indices_of(array_at(archive, "cameras/height", file), kLargestSide, file, "cameras/height");
  read_frames(data, archive, file);
  read_faces(data, archive, file);
  read_body(data, archive, file);
  read_views(data, archive, file);
  check_appearance_data(data, file);
  return data;
}

AppearanceData read_appearance_data(const std::filesystem::path& path, const Limits& limits) {
  return appearance_data_of(read_archive(path, kSchema, kDataVersion, limits), path.string());
}

}  // namespace atelier
