#include "registration/rim_vertices.h"

namespace atelier {

std::vector<char> rim_vertices(const Topology& topology) {
  std::vector<char> rim(static_cast<std::size_t>(topology.vertex_count), 0);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    if (corners_of_edge(topology, e).size() == 1) {
      rim[static_cast<std::size_t>(topology.edges(e, 0))] = 1;
      rim[static_cast<std::size_t>(topology.edges(e, 1))] = 1;
    }
  }
  return rim;
}

}  // namespace atelier
