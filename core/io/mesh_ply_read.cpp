#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_ply.h"
#include "core/io/ply_header.h"
#include "core/io/ply_source.h"
#include "core/io/srgb.h"
#include "core/io/text_writer.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr std::uint64_t kMaxFaceCorners = 1024;  // ear clipping costs the square

/// Meaning of a vertex property.
enum Role { X, Y, Z, Nx, Ny, Nz, Red, Green, Blue, U, V, LabelId, Confidence, Roles };
constexpr int kSkipped = Roles;

int role_of(std::string_view name) {
  struct RoleName {
    std::string_view name;
    Role role;
  };
  static constexpr RoleName kNames[] = {{"x", X},
                                        {"y", Y},
                                        {"z", Z},
                                        {"nx", Nx},
                                        {"ny", Ny},
                                        {"nz", Nz},
                                        {"red", Red},
                                        {"green", Green},
                                        {"blue", Blue},
                                        {"r", Red},
                                        {"g", Green},
                                        {"b", Blue},
                                        {"s", U},
                                        {"t", V},
                                        {"u", U},
                                        {"v", V},
                                        {"texture_u", U},
                                        {"texture_v", V},
                                        {"label", LabelId},
                                        {"confidence", Confidence},
                                        {"diffuse_red", Red},
                                        {"diffuse_green", Green},
                                        {"diffuse_blue", Blue}};
  for (const RoleName& one : kNames) {
    if (one.name == name) {
      return one.role;
    }
  }
  return kSkipped;
}

/// The (vertex, u, v) that are already known, so that equal ones share a row.
struct CornerUv {
  int vertex;
  double u;
  double v;
  bool operator==(const CornerUv&) const = default;
};
struct CornerUvHash {
  std::size_t operator()(const CornerUv& key) const {
    const std::hash<double> hash;
    return (static_cast<std::size_t>(key.vertex) * 0x9E3779B97F4A7C15U) ^ (hash(key.u) * 31) ^
           hash(key.v);
  }
};

template <class Source>
class PlyBody {
 public:
  PlyBody(Source source, const PlyHeader& header, const std::string& name, const Limits& limits)
      : source_(std::move(source)), header_(header), name_(name), limits_(limits) {}

  PolygonMesh read();

 private:
  using Lists = std::vector<double>;

  std::uint64_t paid(const PlyElement& element) const;
  void read_vertices(const PlyElement& element);
  void read_faces(const PlyElement& element);
  void skip_element(const PlyElement& element);
  void skip(const PlyProperty& property);
  std::uint64_t list_length(const PlyProperty& property);
  void read_polygon(const PlyProperty& property, std::uint64_t row);
  void read_corner_uvs(const PlyProperty& property);
  void add_corner_uvs();
  void finish_vertices();
  void finish_faces();
  void check_finite(double value, const char* element, std::uint64_t row,
                    const std::string& property) const;
  void check_coordinate(double value, const char* element, std::uint64_t row) const {
    if (std::abs(value) > limits_.mesh_coordinate) {
      fail_row(element, row, "coordinate " + number_text(value),
               "at most " + number_text(limits_.mesh_coordinate));
    }
  }
  [[noreturn]] void fail_row(const char* element, std::uint64_t row, const std::string& found,
                             const std::string& expected) const {
    throw DataError(name_, std::string(element) + " " + std::to_string(row), found, expected);
  }
  void note(const char* code, const std::string& what) {
    mesh_.findings.push_back({Severity::Note, code, name_, what, ""});
  }

  Source source_;
  const PlyHeader& header_;
  std::string name_;
  Limits limits_;
  PolygonMesh mesh_;
  std::array<bool, Roles + 1> has_{};
  bool has_vertices_ = false;
  std::int64_t triangles_ = 0;
  std::vector<double> uv_list_;  // of the face at hand
  std::vector<double> uv_rows_;
  std::unordered_map<CornerUv, int, CornerUvHash> uv_index_;
  std::uint64_t clamped_ = 0;
};

template <class Source>
PolygonMesh PlyBody<Source>::read() {
  for (const PlyElement& element : header_.elements) {
    if (element.name == "tristrips") {
      throw DataError(name_, "header", "triangle strips", "an element \"face\"");
    }
    if (element.name == "vertex") {
      read_vertices(element);
    } else if (element.name == "face") {
      read_faces(element);
    } else {
      skip_element(element);
    }
  }
  source_.end();
  if (!has_vertices_) {
    throw DataError(name_, "header", "no vertex", "an element \"vertex\" with at least one row");
  }
  finish_faces();
  return std::move(mesh_);
}

template <class Source>
std::uint64_t PlyBody<Source>::paid(const PlyElement& element) const {
  std::size_t row_bytes = 0;
  for (const PlyProperty& property : element.properties) {
    row_bytes += Source::min_bytes(property.is_list ? property.count_type : property.type);
  }
  if (element.count > 0 && element.count > source_.bytes_left() / row_bytes) {
    source_.fail(std::to_string(element.count) + " rows of '" + element.name + "' in " +
                     std::to_string(source_.bytes_left()) + " bytes",
                 "at least " + std::to_string(row_bytes) + " bytes for each");
  }
  return element.count;
}

template <class Source>
std::uint64_t PlyBody<Source>::list_length(const PlyProperty& property) {
  const double length = source_.value(property.count_type);
  if (length < 0) {
    source_.fail("a list of " + std::to_string(saturating_cast<std::int64_t>(length)) + " items",
                 "0 or more");
  }
  return saturating_cast<std::uint64_t>(length);
}

template <class Source>
void PlyBody<Source>::skip(const PlyProperty& property) {
  source_.skip(property.type, property.is_list ? list_length(property) : 1);
}

template <class Source>
void PlyBody<Source>::skip_element(const PlyElement& element) {
  const std::uint64_t count = paid(element);
  for (std::uint64_t row = 0; row < count; ++row) {
    source_.begin_row();
    for (const PlyProperty& property : element.properties) {
      skip(property);
    }
    source_.end_row();
  }
}

template <class Source>
void PlyBody<Source>::check_finite(double value, const char* element, std::uint64_t row,
                                   const std::string& property) const {
  if (!std::isfinite(value)) {
    fail_row(element, row, property + " is " + std::to_string(value), "a finite number");
  }
}

template <class Source>
void PlyBody<Source>::read_vertices(const PlyElement& element) {
  const std::uint64_t count = paid(element);
  if (count > static_cast<std::uint64_t>(limits_.mesh_vertices)) {
    throw DataError(name_, "header", std::to_string(count) + " vertices",
                    "at most " + std::to_string(limits_.mesh_vertices));
  }
  has_vertices_ = count > 0;
  std::vector<int> roles;
  std::array<double, Roles> scale;
  scale.fill(1);
  for (const PlyProperty& property : element.properties) {
    const int role = property.is_list ? kSkipped : role_of(property.name);
    if (role != kSkipped && has_[role]) {
      throw DataError(name_, "header", "two properties that mean '" + property.name + "'", "one");
    }
    has_[role] = true;
    roles.push_back(role);
    if (role >= Red && role <= Blue && !is_floating(property.type)) {
      if (property.type != PlyType::UInt8 && property.type != PlyType::UInt16) {
        throw DataError(name_, "header", "colours of a signed or 32-bit type",
                        "uchar, ushort or float");
      }
      scale[role] = property.type == PlyType::UInt8 ? 255 : 65'535;
    }
  }
  const auto all = [&](Role first, int n) {
    const auto from = has_.begin() + first;
    const bool any = std::find(from, from + n, true) != from + n;
    if (any && std::find(from, from + n, false) != from + n) {
      throw DataError(name_, "header", "some but not all of x y z, nx ny nz, red green blue or u v",
                      "all of each");
    }
    return any;
  };
  if (!all(X, 3)) {
    throw DataError(name_, "header", "vertices without x, y and z", "properties x, y and z");
  }
  const Index rows = static_cast<Index>(count);
  mesh_.vertices.resize(rows, 3);
  mesh_.vertex_normals.resize(all(Nx, 3) ? rows : 0, 3);
  mesh_.colors.resize(all(Red, 3) ? rows : 0, 3);
  mesh_.uvs.resize(all(U, 2) ? rows : 0, 2);
  mesh_.labels.resize(has_[LabelId] ? count : 0);
  mesh_.confidence.resize(has_[Confidence] ? rows : 0);

  std::array<double, Roles + 1> value{};
  for (std::uint64_t row = 0; row < count; ++row) {
    source_.begin_row();
    for (std::size_t i = 0; i < roles.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (roles[i] == kSkipped) {
        skip(property);
        continue;
      }
      value[roles[i]] = source_.value(property.type);
      check_finite(value[roles[i]], "vertex", row, property.name);
    }
    source_.end_row();
    for (const Role role : {X, Y, Z, U, V}) {
      check_coordinate(value[role], "vertex", row);
    }
    const Index v = static_cast<Index>(row);
    for (int axis = 0; axis < 3; ++axis) {
      mesh_.vertices(v, axis) = value[X + axis];
      if (has_[Nx]) {
        mesh_.vertex_normals(v, axis) = value[Nx + axis];
      }
      if (has_[Red]) {
        const double color = value[Red + axis] / scale[Red + axis];
        if (color < 0 || color > 1) {
          fail_row("vertex", row, "colour " + short_number(color, 7), "0 to 1");
        }
        mesh_.colors(v, axis) = linear_from_srgb(static_cast<float>(color));
      }
    }
    if (has_[U]) {
      mesh_.uvs.row(v) << value[U], value[V];
    }
    if (has_[LabelId]) {
      const double label = value[LabelId];
      if (!(label >= 0 && label <= 255) || label != std::floor(label)) {
        fail_row("vertex", row, "label " + short_number(label, 7), "a whole number, 0 to 255");
      }
      mesh_.labels[row] = saturating_cast<std::uint8_t>(label);
    }
    if (has_[Confidence]) {
      const double confidence = std::clamp(value[Confidence], 0.0, 1.0);
      clamped_ += confidence != value[Confidence] ? 1 : 0;
      mesh_.confidence[v] = static_cast<float>(confidence);
    }
  }
  finish_vertices();
}

template <class Source>
void PlyBody<Source>::finish_vertices() {
  if (clamped_ > 0) {
    note("ply-confidence", std::to_string(clamped_) + " confidences were clamped to [0,1]");
  }
  if (!make_unit_rows(mesh_.vertex_normals)) {
    mesh_.vertex_normals.resize(0, 3);
    note("ply-normals", "some normals have no direction; all were dropped");
  }
}

template <class Source>
void PlyBody<Source>::read_faces(const PlyElement& element) {
  const std::uint64_t count = paid(element);
  const PlyProperty* corners = nullptr;
  const PlyProperty* uvs = nullptr;
  for (const PlyProperty& property : element.properties) {
    if (property.name == "vertex_indices" || property.name == "vertex_index") {
      if (!property.is_list || is_floating(property.type) || corners != nullptr) {
        throw DataError(name_, "header",
                        "'" + property.name + "' is no list of integers, or one of two",
                        "one \"property list uchar int vertex_indices\"");
      }
      corners = &property;
    } else if (property.name == "texcoord" && property.is_list) {
      uvs = &property;
    }
  }
  if (corners == nullptr && count > 0) {
    throw DataError(name_, "header", "faces without vertex_indices",
                    "\"property list uchar int vertex_indices\"");
  }
  if (static_cast<std::uint64_t>(limits_.mesh_faces) < count) {
    throw DataError(name_, "header", std::to_string(count) + " faces",
                    "at most " + std::to_string(limits_.mesh_faces));
  }
  mesh_.polygon_starts.reserve(count + 1);
  for (std::uint64_t row = 0; row < count; ++row) {
    source_.begin_row();
    for (const PlyProperty& property : element.properties) {
      if (&property == corners) {
        read_polygon(property, row);
      } else if (&property == uvs) {
        read_corner_uvs(property);
      } else {
        skip(property);
      }
    }
    source_.end_row();
    if (uvs != nullptr) {
      add_corner_uvs();
    }
  }
}

template <class Source>
void PlyBody<Source>::read_polygon(const PlyProperty& property, std::uint64_t row) {
  const std::uint64_t length = list_length(property);
  if (length < 3 || length > kMaxFaceCorners) {
    fail_row("face", row, std::to_string(length) + (length == 1 ? " corner" : " corners"),
             "3 to " + std::to_string(kMaxFaceCorners));
  }
  triangles_ += static_cast<std::int64_t>(length) - 2;
  if (triangles_ > limits_.mesh_faces) {
    fail_row("face", row, "more than " + std::to_string(limits_.mesh_faces) + " triangles",
             "a smaller mesh");
  }
  for (std::uint64_t i = 0; i < length; ++i) {
    const double index = source_.value(property.type);
    if (index < 0 || index >= static_cast<double>(limits_.mesh_vertices)) {
      fail_row("face", row, "index " + std::to_string(saturating_cast<std::int64_t>(index)),
               "the index of a vertex");
    }
    mesh_.corner_vertices.push_back(saturating_cast<int>(index));
  }
  mesh_.polygon_starts.push_back(static_cast<int>(mesh_.corner_vertices.size()));
}

template <class Source>
void PlyBody<Source>::read_corner_uvs(const PlyProperty& property) {
  const std::uint64_t length = list_length(property);
  if (length > 2 * kMaxFaceCorners) {
    source_.fail("texcoord of " + counted(static_cast<std::int64_t>(length), "number"),
                 "two a corner");
  }
  uv_list_.clear();
  for (std::uint64_t i = 0; i < length; ++i) {
    uv_list_.push_back(source_.value(property.type));
    if (!std::isfinite(uv_list_.back())) {
      source_.fail("a texture coordinate that is not finite", "a finite number");
    }
  }
}

template <class Source>
void PlyBody<Source>::add_corner_uvs() {
  const std::size_t polygons = mesh_.polygon_starts.size() - 1;
  const int start = mesh_.polygon_starts[polygons - 1];
  const int end = mesh_.polygon_starts[polygons];
  const bool given = !uv_list_.empty();
  if (given && std::cmp_not_equal(uv_list_.size(), 2 * (end - start))) {
    fail_row("face", polygons - 1,
             "texcoord of " + counted(static_cast<std::int64_t>(uv_list_.size()), "number"),
             std::to_string(2 * (end - start)));
  }
  for (const double coordinate : uv_list_) {
    check_coordinate(coordinate, "face", polygons - 1);
  }
  for (int corner = start; corner < end; ++corner) {
    if (!given) {
      mesh_.corner_uvs.push_back(-1);
      continue;
    }
    const std::size_t at = 2 * static_cast<std::size_t>(corner - start);
    const CornerUv key{mesh_.corner_vertices[corner], uv_list_[at], uv_list_[at + 1]};
    const auto [place, fresh] = uv_index_.try_emplace(key, static_cast<int>(uv_rows_.size() / 2));
    if (fresh) {
      uv_rows_.insert(uv_rows_.end(), {key.u, key.v});
    }
    mesh_.corner_uvs.push_back(place->second);
  }
}

template <class Source>
void PlyBody<Source>::finish_faces() {
  const std::size_t polygons = mesh_.polygon_starts.size() - 1;
  for (std::size_t p = 0; p < polygons; ++p) {
    for (int c = mesh_.polygon_starts[p]; c < mesh_.polygon_starts[p + 1]; ++c) {
      if (mesh_.corner_vertices[c] >= mesh_.vertices.rows()) {
        fail_row("face", p, "index " + std::to_string(mesh_.corner_vertices[c]),
                 "0 to " + std::to_string(mesh_.vertices.rows() - 1));
      }
    }
  }
  if (!uv_rows_.empty()) {
    mesh_.uvs =
        Eigen::Map<const Points2>(uv_rows_.data(), static_cast<Index>(uv_rows_.size() / 2), 2);
  } else {
    mesh_.corner_uvs.clear();
    if (mesh_.uvs.rows() > 0) {
      mesh_.corner_uvs = mesh_.corner_vertices;
    }
  }
}

}  // namespace

PolygonMesh read_ply(std::span<const std::byte> bytes, const std::string& name,
                     const Limits& limits) {
  const PlyHeader header = read_ply_header(bytes, name, limits);
  PolygonMesh mesh =
      header.format == PlyFormat::Ascii
          ? PlyBody(AsciiSource(bytes, header, name, limits), header, name, limits).read()
          : PlyBody(BinarySource(bytes, header, name), header, name, limits).read();
  mesh.convention = header.convention;
  return mesh;
}

PolygonMesh read_ply(const std::filesystem::path& path, const Limits& limits) {
  return read_ply(read_file_bytes(path, limits.mesh_file_bytes), path.string(), limits);
}

}  // namespace atelier
