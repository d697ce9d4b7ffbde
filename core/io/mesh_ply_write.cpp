#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/mesh_ply.h"
#include "core/io/srgb.h"
#include "core/io/text_writer.h"
#include "core/io/to_float.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

/// Numbers behind each other, as text or binary.
class PlySink {
 public:
  explicit PlySink(PlyFormat format) : format_(format) {}

  template <class T>
  void put(T value) {
    if (format_ == PlyFormat::Ascii) {
      if (!row_is_new_) {
        text_ += ' ';
      }
      row_is_new_ = false;
      if constexpr (sizeof(T) == 1) {
        append_number(text_, static_cast<int>(value));
      } else {
        append_number(text_, value);
      }
      return;
    }
    char bytes[sizeof(T)];
    std::copy_n(reinterpret_cast<const char*>(&value), sizeof(T), bytes);
    const bool big = format_ == PlyFormat::BinaryBigEndian;
    if (big != (std::endian::native == std::endian::big)) {
      std::reverse(bytes, bytes + sizeof(T));
    }
    text_.append(bytes, sizeof(T));
  }

  void put_real(double value, bool as_double) {
    if (as_double) {
      put(value);
    } else {
      put(to_float(value, "a mesh with a number"));
    }
  }

  void end_row() {
    if (format_ == PlyFormat::Ascii) {
      text_ += '\n';
      row_is_new_ = true;
    }
  }

  std::string& text() { return text_; }

 private:
  PlyFormat format_;
  std::string text_;
  bool row_is_new_ = true;
};

/// Rows of mesh.uvs by vertex where every vertex has one, else empty.
std::vector<int> uv_of_vertex(const PolygonMesh& mesh) {
  if (mesh.corner_uvs.empty()) {
    return {};
  }
  std::vector<int> uv(static_cast<std::size_t>(mesh.vertices.rows()), -1);
  for (std::size_t c = 0; c < mesh.corner_uvs.size(); ++c) {
    int& known = uv[mesh.corner_vertices[c]];
    if (mesh.corner_uvs[c] < 0 || (known >= 0 && known != mesh.corner_uvs[c])) {
      return {};
    }
    known = mesh.corner_uvs[c];
  }
  return std::find(uv.begin(), uv.end(), -1) == uv.end() ? uv : std::vector<int>();
}

const char* format_name(PlyFormat format) {
  switch (format) {
    case PlyFormat::Ascii:
      return "ascii";
    case PlyFormat::BinaryLittleEndian:
      return "binary_little_endian";
    case PlyFormat::BinaryBigEndian:
      return "binary_big_endian";
  }
  return "";
}

std::string properties(const char* type, std::initializer_list<const char*> names) {
  std::string text;
  for (const char* name : names) {
    text += std::string("property ") + type + ' ' + name + '\n';
  }
  return text;
}

std::string header_of(const PolygonMesh& mesh, const PlyOptions& options, bool vertex_uvs,
                      bool many_corners) {
  const char* real = options.exact ? "double" : "float";
  std::string text = std::string("ply\nformat ") + format_name(options.format) + " 1.0\n";
  text += convention_comments(mesh.convention, "comment ");
  text += "element vertex " + std::to_string(mesh.vertices.rows()) + '\n';
  text += properties(real, {"x", "y", "z"});
  if (mesh.vertex_normals.rows() > 0) {
    text += properties(real, {"nx", "ny", "nz"});
  }
  if (mesh.colors.rows() > 0) {
    text += properties(options.exact ? "float" : "uchar", {"red", "green", "blue"});
  }
  if (vertex_uvs) {
    text += properties(real, {"s", "t"});
  }
  if (!mesh.labels.empty()) {
    text += properties("uchar", {"label"});
  }
  if (mesh.confidence.size() > 0) {
    text += properties("float", {"confidence"});
  }
  const char* count = many_corners ? "ushort" : "uchar";
  text += "element face " + std::to_string(polygon_count(mesh)) + '\n';
  text += std::string("property list ") + count + " int vertex_indices\n";
  if (!mesh.corner_uvs.empty() && !vertex_uvs) {
    text += std::string("property list ") + count + " " + real + " texcoord\n";
  }
  return text + "end_header\n";
}

void put_vertex(PlySink& sink, const PolygonMesh& mesh, Index v, bool exact) {
  for (int axis = 0; axis < 3; ++axis) {
    sink.put_real(mesh.vertices(v, axis), exact);
  }
  for (int axis = 0; axis < 3 && mesh.vertex_normals.rows() > 0; ++axis) {
    sink.put_real(mesh.vertex_normals(v, axis), exact);
  }
  for (int channel = 0; channel < 3 && mesh.colors.rows() > 0; ++channel) {
    const float srgb = srgb_from_linear(mesh.colors(v, channel));
    if (exact) {
      sink.put(srgb);
    } else {
      sink.put(saturating_cast<std::uint8_t>(std::round(255 * srgb)));
    }
  }
}

}  // namespace

std::string ply_bytes(const PolygonMesh& mesh, const PlyOptions& options) {
  check_polygons(mesh);
  const std::vector<int> vertex_uvs = uv_of_vertex(mesh);
  const bool corner_uvs = !mesh.corner_uvs.empty() && vertex_uvs.empty();
  int max_corners = 0;
  for (Index p = 0; p < polygon_count(mesh); ++p) {
    max_corners = std::max(max_corners, mesh.polygon_starts[p + 1] - mesh.polygon_starts[p]);
  }
  const bool many_corners = 2 * max_corners > 255;
  ATELIER_CHECK(2 * max_corners <= 65'535, "a polygon of too many corners");

  PlySink sink(options.format);
  sink.text() = header_of(mesh, options, !vertex_uvs.empty(), many_corners);
  const auto put_count = [&](int count) {
    if (many_corners) {
      sink.put(static_cast<std::uint16_t>(count));
    } else {
      sink.put(static_cast<std::uint8_t>(count));
    }
  };
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    put_vertex(sink, mesh, v, options.exact);
    for (int i = 0; i < 2 && !vertex_uvs.empty(); ++i) {
      sink.put_real(mesh.uvs(vertex_uvs[v], i), options.exact);
    }
    if (!mesh.labels.empty()) {
      sink.put(mesh.labels[v]);
    }
    if (mesh.confidence.size() > 0) {
      sink.put(mesh.confidence[v]);
    }
    sink.end_row();
  }
  for (Index p = 0; p < polygon_count(mesh); ++p) {
    const int start = mesh.polygon_starts[p];
    const int end = mesh.polygon_starts[p + 1];
    put_count(end - start);
    for (int c = start; c < end; ++c) {
      sink.put(mesh.corner_vertices[c]);
    }
    if (corner_uvs) {
      const bool given = std::none_of(mesh.corner_uvs.begin() + start,
                                      mesh.corner_uvs.begin() + end, [](int uv) { return uv < 0; });
      put_count(given ? 2 * (end - start) : 0);
      for (int c = start; given && c < end; ++c) {
        sink.put_real(mesh.uvs(mesh.corner_uvs[c], 0), options.exact);
        sink.put_real(mesh.uvs(mesh.corner_uvs[c], 1), options.exact);
      }
    }
    sink.end_row();
  }
  return std::move(sink.text());
}

void write_ply(const std::filesystem::path& path, const PolygonMesh& mesh,
               const PlyOptions& options) {
  write_file_atomically(path, ply_bytes(mesh, options));
}

void write_ply(const std::filesystem::path& path, const Mesh& mesh, const PlyOptions& options) {
  write_ply(path, polygons_of(mesh), options);
}

}  // namespace atelier
