#pragma once

#include <vector>

#include "core/topology.h"
#include "core/types.h"

namespace atelier {

/// Shortest ways along a surface's edges from a set of vertices. Private to registration.
struct EdgePaths {
  std::vector<double> distances;  ///< [V] infinite where there is no way
  std::vector<int> parents;       ///< [V] edge towards the set, -1 at its vertices
};

/// The edges of each vertex, and Dijkstra's algorithm over them.
class EdgeGraph {
 public:
  explicit EdgeGraph(const Topology& topology);

  /// From `sources` (at distance 0), over edges with `costs[edge]` finite. O(E log V).
  EdgePaths paths_from(const std::vector<int>& sources, const std::vector<double>& costs) const;

  /// Edges on the way from a vertex back to the set that the paths start from.
  std::vector<int> way_back(const EdgePaths& paths, int vertex) const;

  std::span<const int> edges_of(int vertex) const { return edges_[vertex]; }
  int other_end(int edge, int vertex) const {
    return ends_(edge, 0) == vertex ? ends_(edge, 1) : ends_(edge, 0);
  }

 private:
  Edges ends_;
  Adjacency edges_;  ///< of each vertex
};

/// Length of each edge, m, [E].
std::vector<double> edge_lengths(const Topology& topology, const Points& vertices);

}  // namespace atelier
