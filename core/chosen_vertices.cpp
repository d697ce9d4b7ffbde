#include "core/chosen_vertices.h"

namespace atelier {

Mesh chosen_vertices(const Mesh& mesh, const std::vector<int>& rows) {
  Mesh chosen;
  chosen.vertices = mesh.vertices(rows, Eigen::all);
  if (mesh.normals.rows() > 0) {
    chosen.normals = mesh.normals(rows, Eigen::all);
  }
  if (mesh.colors.rows() > 0) {
    chosen.colors = mesh.colors(rows, Eigen::all);
  }
  if (mesh.confidence.size() > 0) {
    chosen.confidence = mesh.confidence(rows);
  }
  if (!mesh.labels.empty()) {
    chosen.labels.reserve(rows.size());
    for (const int row : rows) {
      chosen.labels.push_back(mesh.labels[static_cast<std::size_t>(row)]);
    }
  }
  return chosen;
}

}  // namespace atelier
