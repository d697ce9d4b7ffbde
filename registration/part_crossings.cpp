#include "registration/part_crossings.h"

#include <array>
#include <utility>
#include <vector>

#include "core/intersection.h"
#include "core/topology.h"
#include "registration/rim_vertices.h"

namespace atelier {

PartedMesh part_crossings(Mesh mesh, int rounds) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const Adjacency neighbors = vertex_neighbors(topology);
  const std::vector<char> rim = rim_vertices(topology);
  std::vector<std::array<int, 2>> pairs = self_intersections(mesh.vertices, mesh.faces);
  for (int round = 0; round < rounds && !pairs.empty(); ++round) {
    std::vector<char> moved(rim.size(), 0);
    for (const std::array<int, 2>& pair : pairs) {
      for (const int face : pair) {
        for (int k = 0; k < 3; ++k) {
          moved[static_cast<std::size_t>(mesh.faces(face, k))] = 1;
          for (const int other : neighbors[mesh.faces(face, k)]) {
            moved[static_cast<std::size_t>(other)] = 1;
          }
        }
      }
    }
    Points next = mesh.vertices;
    for (Index v = 0; v < next.rows(); ++v) {
      if (moved[static_cast<std::size_t>(v)] == 0) {
        continue;
      }
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      double count = 0;
      for (const int other : neighbors[v]) {
        if (rim[static_cast<std::size_t>(v)] == 0 || rim[static_cast<std::size_t>(other)] != 0) {
          sum += mesh.vertices.row(other);
          count += 1;
        }
      }
      if (count > 0) {
        next.row(v) = 0.5 * mesh.vertices.row(v) + 0.5 * sum / count;
      }
    }
    mesh.vertices = std::move(next);
    pairs = self_intersections(mesh.vertices, mesh.faces);
  }
  return {std::move(mesh), static_cast<int>(pairs.size())};
}

}  // namespace atelier
