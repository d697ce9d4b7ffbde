#include "registration/loose_vertices.h"

#include "core/chosen_vertices.h"

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
  Mesh result = chosen_vertices(mesh, kept);
  result.faces = mesh.faces;
  result.uvs = mesh.uvs;
  result.uv_faces = mesh.uv_faces;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      result.faces(f, k) = place[static_cast<std::size_t>(mesh.faces(f, k))];
    }
  }
  return result;
}

}  // namespace atelier
