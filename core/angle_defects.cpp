#include "core/angle_defects.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace atelier {

std::vector<double> angle_defects(const Points& vertices, const Topology& topology) {
  ATELIER_CHECK(vertices.rows() == topology.vertex_count, "as many vertices as the topology has");
  const Triangles& faces = topology.faces;
  std::vector<double> defects(static_cast<std::size_t>(vertices.rows()), 2 * std::numbers::pi);
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d at = vertices.row(faces(f, k));
      const Eigen::Vector3d a = vertices.row(faces(f, (k + 1) % 3)).transpose() - at;
      const Eigen::Vector3d b = vertices.row(faces(f, (k + 2) % 3)).transpose() - at;
      defects[static_cast<std::size_t>(faces(f, k))] -= std::atan2(a.cross(b).norm(), a.dot(b));
    }
  }
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    if (corners_of_edge(topology, e).size() != 2) {
      defects[static_cast<std::size_t>(topology.edges(e, 0))] = 0;
      defects[static_cast<std::size_t>(topology.edges(e, 1))] = 0;
    }
  }
  return defects;
}

}  // namespace atelier
