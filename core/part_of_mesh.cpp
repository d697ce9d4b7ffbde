#include "core/part_of_mesh.h"

#include "core/chosen_vertices.h"
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
  Mesh part = chosen_vertices(mesh, used.rows);
  part.faces = used.faces;
  if (mesh.uv_faces.rows() > 0) {
    const UsedRows uvs = used_rows(mesh.uv_faces, mesh.uvs.rows(), faces);
    part.uv_faces = uvs.faces;
    part.uvs = mesh.uvs(uvs.rows, Eigen::all);
  }
  return part;
}

}  // namespace atelier
