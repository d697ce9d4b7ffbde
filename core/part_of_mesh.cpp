#include "core/part_of_mesh.h"

#include "core/error.h"

namespace atelier {
namespace {

/// Some rows of `faces`, renumbered so that only what they use is left.
struct UsedRows {
  Triangles faces;
  std::vector<int> rows;  ///< old number of each new one
};

UsedRows used_rows(const Triangles& faces, Index count, const std::vector<Index>& kept) {
  UsedRows used;
  std::vector<int> place(static_cast<std::size_t>(count), -1);
  used.faces.resize(static_cast<Index>(kept.size()), 3);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const int row = faces(kept[i], k);
      int& at = place[static_cast<std::size_t>(row)];
      if (at < 0) {
        at = static_cast<int>(used.rows.size());
        used.rows.push_back(row);
      }
      used.faces(static_cast<Index>(i), k) = at;
    }
  }
  return used;
}

}  // namespace

Mesh part_of_mesh(const Mesh& mesh, const std::vector<Index>& faces) {
  for (const Index face : faces) {
    ATELIER_CHECK(face >= 0 && face < mesh.faces.rows(), "a face that the mesh does not have");
  }
  const UsedRows used = used_rows(mesh.faces, mesh.vertices.rows(), faces);
  Mesh part;
  part.faces = used.faces;
  part.vertices = mesh.vertices(used.rows, Eigen::all);
  if (mesh.normals.rows() > 0) {
    part.normals = mesh.normals(used.rows, Eigen::all);
  }
  if (mesh.colors.rows() > 0) {
    part.colors = mesh.colors(used.rows, Eigen::all);
  }
  if (mesh.confidence.size() > 0) {
    part.confidence = mesh.confidence(used.rows);
  }
  for (std::size_t i = 0; i < used.rows.size() && !mesh.labels.empty(); ++i) {
    part.labels.push_back(mesh.labels[static_cast<std::size_t>(used.rows[i])]);
  }
  if (mesh.uv_faces.rows() > 0) {
    const UsedRows uvs = used_rows(mesh.uv_faces, mesh.uvs.rows(), faces);
    part.uv_faces = uvs.faces;
    part.uvs = mesh.uvs(uvs.rows, Eigen::all);
  }
  return part;
}

}  // namespace atelier
