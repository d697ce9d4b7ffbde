#include "registration/flattening/cut_to_disks.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "core/error.h"
#include "registration/edge_paths.h"
#include "registration/flattening/surface_cut.h"

namespace atelier {
namespace {

int find_set(std::vector<int>& parents, int i) {
  while (parents[static_cast<std::size_t>(i)] != i) {
    parents[static_cast<std::size_t>(i)] =
        parents[static_cast<std::size_t>(parents[static_cast<std::size_t>(i)])];
    i = parents[static_cast<std::size_t>(i)];
  }
  return i;
}

}  // namespace

std::vector<char> cut_to_disks(const Topology& topology, const std::vector<char>& cut,
                               const std::vector<double>& costs) {
  ATELIER_CHECK(
      cut.size() == costs.size() && static_cast<Index>(cut.size()) == topology.edges.rows(),
      "a flag and a cost for each edge");
  ATELIER_CHECK(std::all_of(costs.begin(), costs.end(), [](double cost) { return cost >= 0; }),
                "costs that are not negative");
  // Over the cut surface, whose boundaries are where cuts begin and end.
  const SurfaceCut open = cut_surface(topology, cut);
  const Topology over = topology_of(open.faces, static_cast<Index>(open.source.size()));
  std::vector<int> whole_edge(static_cast<std::size_t>(over.edges.rows()));
  std::vector<double> over_costs(whole_edge.size());
  std::vector<char> on_boundary(open.source.size(), 0);
  for (Index e = 0; e < over.edges.rows(); ++e) {
    const int corner = corners_of_edge(over, e).front();
    const int whole = topology.face_edges(corner / 3, corner % 3);
    whole_edge[static_cast<std::size_t>(e)] = whole;
    over_costs[static_cast<std::size_t>(e)] = costs[static_cast<std::size_t>(whole)];
    if (corners_of_edge(over, e).size() == 1) {
      on_boundary[static_cast<std::size_t>(over.edges(e, 0))] = 1;
      on_boundary[static_cast<std::size_t>(over.edges(e, 1))] = 1;
    }
  }
  std::vector<char> has_boundary(static_cast<std::size_t>(open.panel_count), 0);
  std::vector<int> some_vertex(static_cast<std::size_t>(open.panel_count), -1);
  std::vector<int> roots;
  for (Index f = 0; f < over.faces.rows(); ++f) {
    const auto panel = static_cast<std::size_t>(open.panels[static_cast<std::size_t>(f)]);
    some_vertex[panel] = over.faces(f, 0);
    for (int k = 0; k < 3; ++k) {
      has_boundary[panel] = static_cast<char>(
          has_boundary[panel] | on_boundary[static_cast<std::size_t>(over.faces(f, k))]);
    }
  }
  for (std::size_t v = 0; v < on_boundary.size(); ++v) {
    if (on_boundary[v] != 0) {
      roots.push_back(static_cast<int>(v));
    }
  }
  for (std::size_t panel = 0; panel < has_boundary.size(); ++panel) {
    if (has_boundary[panel] == 0) {
      roots.push_back(some_vertex[panel]);
    }
  }
  const EdgeGraph graph(over);
  const EdgePaths paths = graph.paths_from(roots, over_costs);
  std::vector<char> in_tree(whole_edge.size(), 0);
  for (const int parent : paths.parents) {
    if (parent >= 0) {
      in_tree[static_cast<std::size_t>(parent)] = 1;
    }
  }
  // Inner edges off the tree, the longest loop first, join faces to a tree; what is left over
  // closes a loop or an arc that must be cut.
  std::vector<std::pair<double, int>> rest;
  for (Index e = 0; e < over.edges.rows(); ++e) {
    if (corners_of_edge(over, e).size() == 2 && in_tree[static_cast<std::size_t>(e)] == 0) {
      rest.emplace_back(paths.distances[static_cast<std::size_t>(over.edges(e, 0))] +
                            paths.distances[static_cast<std::size_t>(over.edges(e, 1))] +
                            over_costs[static_cast<std::size_t>(e)],
                        static_cast<int>(e));
    }
  }
  std::sort(rest.begin(), rest.end(), [](const auto& a, const auto& b) {
    return a.first > b.first || (a.first == b.first && a.second < b.second);
  });
  std::vector<int> joined(static_cast<std::size_t>(over.faces.rows()));
  std::iota(joined.begin(), joined.end(), 0);
  std::vector<char> result = cut;
  std::vector<char> was_opened(has_boundary.size(), 0);
  const auto add_way = [&](int vertex) {
    for (const int edge : graph.way_back(paths, vertex)) {
      result[static_cast<std::size_t>(whole_edge[static_cast<std::size_t>(edge)])] = 1;
    }
  };
  for (const auto& [loop, edge] : rest) {
    const auto sharing = corners_of_edge(over, edge);
    const int a = find_set(joined, sharing[0] / 3);
    const int b = find_set(joined, sharing[1] / 3);
    if (a != b) {
      joined[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
      continue;
    }
    result[static_cast<std::size_t>(whole_edge[static_cast<std::size_t>(edge)])] = 1;
    add_way(over.edges(edge, 0));
    add_way(over.edges(edge, 1));
    was_opened[static_cast<std::size_t>(open.panels[static_cast<std::size_t>(sharing[0] / 3)])] = 1;
  }
  // Spheres: a slit from the root to the vertex farthest from it.
  for (std::size_t panel = 0; panel < has_boundary.size(); ++panel) {
    if (has_boundary[panel] != 0 || was_opened[panel] != 0) {
      continue;
    }
    int farthest = some_vertex[panel];
    for (Index f = 0; f < over.faces.rows(); ++f) {
      if (open.panels[static_cast<std::size_t>(f)] != static_cast<int>(panel)) {
        continue;
      }
      for (int k = 0; k < 3; ++k) {
        if (paths.distances[static_cast<std::size_t>(over.faces(f, k))] >
            paths.distances[static_cast<std::size_t>(farthest)]) {
          farthest = over.faces(f, k);
        }
      }
    }
    add_way(farthest);
  }
  return result;
}

}  // namespace atelier
