#include "capture/surface/holes.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "core/topology.h"

namespace atelier {

std::vector<Hole> find_holes(const Mesh& mesh) {
  std::vector<Hole> holes;
  for (std::vector<int>& loop : boundary_loops(topology_of(mesh.faces, mesh.vertices.rows()))) {
    Hole hole;
    hole.loop = std::move(loop);
    const auto corner = [&](std::size_t i) -> Eigen::Vector3d {
      return mesh.vertices.row(hole.loop[i % hole.loop.size()]).transpose();
    };
    for (std::size_t i = 0; i < hole.loop.size(); ++i) {
      const double edge = (corner(i + 1) - corner(i)).norm();
      hole.centre += edge * 0.5 * (corner(i) + corner(i + 1));
      hole.length += edge;
    }
    hole.centre = hole.length > 0 ? Eigen::Vector3d(hole.centre / hole.length) : corner(0);
    for (std::size_t i = 0; i < hole.loop.size(); ++i) {
      hole.area += 0.5 * (corner(i) - hole.centre).cross(corner(i + 1) - hole.centre).norm();
    }
    holes.push_back(std::move(hole));
  }
  std::stable_sort(holes.begin(), holes.end(),
                   [](const Hole& a, const Hole& b) { return a.area > b.area; });
  return holes;
}

}  // namespace atelier
