#include <algorithm>
#include <boost/graph/adjacency_list.hpp>
#include <cmath>

#include <CGAL/boost/graph/alpha_expansion_graphcut.h>

#include "capture/surface/surface_labels.h"
#include "core/error.h"
#include "core/topology.h"

namespace atelier {
namespace {

struct VertexCosts {
  std::size_t label = 0;
  std::vector<double> costs;
};

struct EdgeCost {
  double weight = 0;
};

using Graph =
    boost::adjacency_list<boost::setS, boost::vecS, boost::undirectedS, VertexCosts, EdgeCost>;

/// How much a vertex's votes count, by its confidence: what the hull closes may lie off the
/// surface. Our choice.
double certainty_of(const Mesh& mesh, Index vertex) {
  constexpr double kLeast = 0.25;
  return mesh.confidence.size() > 0 ? kLeast + (1 - kLeast) * mesh.confidence[vertex] : 1;
}

}  // namespace

std::vector<std::uint8_t> smooth_labels(const Mesh& mesh, const LabelVotes& votes,
                                        const SurfaceLabelOptions& options) {
  const Index n = mesh.vertices.rows();
  if (votes.ids.empty()) {
    return std::vector<std::uint8_t>(static_cast<std::size_t>(n), 255);
  }
  ATELIER_CHECK(votes.probability.rows() == n, "votes for each vertex");
  const Topology topology = topology_of(mesh.faces, n);
  double mean_length = 0;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    mean_length +=
        (mesh.vertices.row(topology.edges(e, 0)) - mesh.vertices.row(topology.edges(e, 1))).norm();
  }
  mean_length /= std::max<double>(1, static_cast<double>(topology.edges.rows()));
  Graph graph(static_cast<std::size_t>(n));
  for (Index v = 0; v < n; ++v) {
    VertexCosts& vertex = graph[static_cast<std::size_t>(v)];
    Index best = 0;
    votes.probability.row(v).maxCoeff(&best);
    vertex.label = static_cast<std::size_t>(best);
    const double certainty = certainty_of(mesh, v);
    for (Index k = 0; k < votes.probability.cols(); ++k) {
      vertex.costs.push_back(-certainty * std::log(std::max(votes.probability(v, k), 1e-6)));
    }
  }
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const int a = topology.edges(e, 0);
    const int b = topology.edges(e, 1);
    const double length = (mesh.vertices.row(a) - mesh.vertices.row(b)).norm();
    // The dual of a short edge is long on an even mesh: a border across it is, too.
    const double weight = options.smoothness * mean_length / std::max(length, 0.1 * mean_length);
    boost::add_edge(static_cast<std::size_t>(a), static_cast<std::size_t>(b), {weight}, graph);
  }
  if (votes.ids.size() > 1 && options.smoothness > 0) {
    CGAL::alpha_expansion_graphcut(
        graph, boost::get(&EdgeCost::weight, graph), boost::get(&VertexCosts::costs, graph),
        boost::get(&VertexCosts::label, graph),
        CGAL::parameters::vertex_index_map(boost::get(boost::vertex_index, graph)));
  }
  std::vector<std::uint8_t> labels;
  for (Index v = 0; v < n; ++v) {
    labels.push_back(votes.ids[graph[static_cast<std::size_t>(v)].label]);
  }
  return labels;
}

}  // namespace atelier
