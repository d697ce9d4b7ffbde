#include "core/mesh.h"

#include "core/error.h"

namespace atelier {
namespace {

template <class Rows>
void check_finite(const Rows& rows, const char* what, const std::string& file) {
  for (Index i = 0; i < rows.rows(); ++i) {
    if (!rows.row(i).allFinite()) {
      throw DataError(file, std::string(what) + " " + std::to_string(i), "not finite",
                      "finite numbers");
    }
  }
}

void check_count(Index found, Index expected, const char* what, const std::string& file) {
  if (found != 0 && found != expected) {
    throw DataError(file, what, std::to_string(found) + " rows", std::to_string(expected));
  }
}

void check_indices(const Triangles& faces, Index count, const char* what, const std::string& file) {
  for (Index i = 0; i < faces.rows(); ++i) {
    for (int corner = 0; corner < 3; ++corner) {
      const int vertex = faces(i, corner);
      if (vertex < 0 || vertex >= count) {
        throw DataError(file, std::string(what) + " " + std::to_string(i),
                        "index " + std::to_string(vertex), "0 to " + std::to_string(count - 1));
      }
    }
  }
}

}  // namespace

void check_mesh(const Mesh& mesh, const std::string& file) {
  const Index vertices = mesh.vertices.rows();
  const Index faces = mesh.faces.rows();
  check_count(mesh.normals.rows(), vertices, "normals", file);
  check_count(mesh.colors.rows(), vertices, "colors", file);
  check_count(static_cast<Index>(mesh.labels.size()), vertices, "labels", file);
  check_count(mesh.confidence.size(), vertices, "confidence", file);
  check_count(mesh.uv_faces.rows(), faces, "uv faces", file);
  check_finite(mesh.vertices, "vertex", file);
  check_finite(mesh.normals, "normal", file);
  check_finite(mesh.colors, "color", file);
  check_finite(mesh.uvs, "uv", file);
  check_finite(mesh.confidence, "confidence", file);
  check_indices(mesh.faces, vertices, "face", file);
  check_indices(mesh.uv_faces, mesh.uvs.rows(), "uv face", file);
}

}  // namespace atelier
