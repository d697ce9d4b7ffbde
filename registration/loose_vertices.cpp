#include "registration/loose_vertices.h"

namespace atelier {

Mesh without_loose_vertices(const Mesh& mesh) {
  std::vector<int> place(static_cast<std::size_t>(mesh.vertices.rows()), -1);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      place[static_cast<std::size_t>(mesh.faces(f, k))] = 0;
    }
  }
  std::vector<int> kept;
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (place[v] == 0) {
      place[v] = static_cast<int>(kept.size());
      kept.push_back(static_cast<int>(v));
    }
  }
  if (kept.size() == place.size()) {
    return mesh;
  }
  Mesh result = mesh;
  result.vertices = mesh.vertices(kept, Eigen::all);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      result.faces(f, k) = place[static_cast<std::size_t>(mesh.faces(f, k))];
    }
  }
  if (mesh.normals.rows() > 0) {
    result.normals = mesh.normals(kept, Eigen::all);
  }
  if (mesh.colors.rows() > 0) {
    result.colors = mesh.colors(kept, Eigen::all);
  }
  if (mesh.confidence.rows() > 0) {
    result.confidence = mesh.confidence(kept);
  }
  if (!mesh.labels.empty()) {
    result.labels.clear();
    for (const int v : kept) {
      result.labels.push_back(mesh.labels[static_cast<std::size_t>(v)]);
    }
  }
  return result;
}

}  // namespace atelier
