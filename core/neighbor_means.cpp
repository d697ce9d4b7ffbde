#include "core/neighbor_means.h"

#include "core/error.h"

namespace atelier {

std::vector<double> neighbor_means(const Topology& topology, std::vector<double> values,
                                   int rounds) {
  ATELIER_CHECK(static_cast<Index>(values.size()) == topology.vertex_count,
                "a value for each vertex");
  std::vector<int> counts(values.size(), 1);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    ++counts[static_cast<std::size_t>(topology.edges(e, 0))];
    ++counts[static_cast<std::size_t>(topology.edges(e, 1))];
  }
  for (int round = 0; round < rounds; ++round) {
    std::vector<double> sums = values;
    for (Index e = 0; e < topology.edges.rows(); ++e) {
      const auto a = static_cast<std::size_t>(topology.edges(e, 0));
      const auto b = static_cast<std::size_t>(topology.edges(e, 1));
      sums[a] += values[b];
      sums[b] += values[a];
    }
    for (std::size_t v = 0; v < values.size(); ++v) {
      values[v] = sums[v] / counts[v];
    }
  }
  return values;
}

}  // namespace atelier
