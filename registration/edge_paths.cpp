#include "registration/edge_paths.h"

#include <limits>
#include <queue>

namespace atelier {

EdgeGraph::EdgeGraph(const Topology& topology) : ends_(topology.edges) {
  std::vector<int> count(static_cast<std::size_t>(topology.vertex_count) + 1, 0);
  for (Index e = 0; e < ends_.rows(); ++e) {
    for (const int k : {0, 1}) {
      ++count[static_cast<std::size_t>(ends_(e, k)) + 1];
    }
  }
  for (std::size_t i = 1; i < count.size(); ++i) {
    count[i] += count[i - 1];
  }
  edges_.offsets = count;
  edges_.items.resize(static_cast<std::size_t>(count.back()));
  for (Index e = 0; e < ends_.rows(); ++e) {
    for (const int k : {0, 1}) {
      edges_.items[static_cast<std::size_t>(count[static_cast<std::size_t>(ends_(e, k))]++)] =
          static_cast<int>(e);
    }
  }
}

EdgePaths EdgeGraph::paths_from(const std::vector<int>& sources,
                                const std::vector<double>& costs) const {
  const auto count = static_cast<std::size_t>(edges_.rows());
  EdgePaths paths{std::vector<double>(count, std::numeric_limits<double>::infinity()),
                  std::vector<int>(count, -1)};
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (const int source : sources) {
    paths.distances[static_cast<std::size_t>(source)] = 0;
    queue.emplace(0, source);
  }
  while (!queue.empty()) {
    const auto [distance, vertex] = queue.top();
    queue.pop();
    if (distance > paths.distances[static_cast<std::size_t>(vertex)]) {
      continue;
    }
    for (const int edge : edges_of(vertex)) {
      const int other = other_end(edge, vertex);
      const double next = distance + costs[static_cast<std::size_t>(edge)];
      if (next < paths.distances[static_cast<std::size_t>(other)]) {
        paths.distances[static_cast<std::size_t>(other)] = next;
        paths.parents[static_cast<std::size_t>(other)] = edge;
        queue.emplace(next, other);
      }
    }
  }
  return paths;
}

std::vector<int> EdgeGraph::way_back(const EdgePaths& paths, int vertex) const {
  std::vector<int> way;
  for (int at = vertex; paths.parents[static_cast<std::size_t>(at)] >= 0;) {
    way.push_back(paths.parents[static_cast<std::size_t>(at)]);
    at = other_end(way.back(), at);
  }
  return way;
}

std::vector<double> edge_lengths(const Topology& topology, const Points& vertices) {
  std::vector<double> lengths;
  lengths.reserve(static_cast<std::size_t>(topology.edges.rows()));
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    lengths.push_back(
        (vertices.row(topology.edges(e, 1)) - vertices.row(topology.edges(e, 0))).norm());
  }
  return lengths;
}

}  // namespace atelier
