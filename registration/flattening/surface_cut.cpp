#include "registration/flattening/surface_cut.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "core/error.h"

namespace atelier {
namespace {

/// Sets of corners (or faces) that belong together; each is known by its smallest member.
class Sets {
 public:
  explicit Sets(Index count) : parents_(static_cast<std::size_t>(count)) {
    std::iota(parents_.begin(), parents_.end(), 0);
  }
  int find(int i) {
    while (parents_[static_cast<std::size_t>(i)] != i) {
      parents_[static_cast<std::size_t>(i)] =
          parents_[static_cast<std::size_t>(parents_[static_cast<std::size_t>(i)])];
      i = parents_[static_cast<std::size_t>(i)];
    }
    return i;
  }
  void join(int i, int j) {
    i = find(i);
    j = find(j);
    parents_[static_cast<std::size_t>(std::max(i, j))] = std::min(i, j);
  }

 private:
  std::vector<int> parents_;
};

}  // namespace

SurfaceCut cut_surface(const Topology& topology, const std::vector<char>& cut) {
  ATELIER_CHECK(static_cast<Index>(cut.size()) == topology.edges.rows(), "a flag for each edge");
  const Index faces = topology.faces.rows();
  Sets corners(3 * faces);
  Sets panels(faces);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto sharing = corners_of_edge(topology, e);
    if (sharing.size() != 2 || cut[static_cast<std::size_t>(e)] != 0) {
      continue;
    }
    panels.join(sharing[0] / 3, sharing[1] / 3);
    // Each end of the edge is the same vertex on both sides.
    for (const int side : {0, 1}) {
      const int from = side == 0 ? sharing[0] : sharing[0] / 3 * 3 + (sharing[0] + 1) % 3;
      for (const int k : {0, 1, 2}) {
        const int other = sharing[1] / 3 * 3 + k;
        if (topology.faces(other / 3, other % 3) == topology.faces(from / 3, from % 3)) {
          corners.join(from, other);
        }
      }
    }
  }
  SurfaceCut result;
  result.faces.resize(faces, 3);
  result.panels.resize(static_cast<std::size_t>(faces));
  std::vector<int> number(static_cast<std::size_t>(3 * faces), -1);
  std::vector<int> panel_number(static_cast<std::size_t>(faces), -1);
  for (int f = 0; f < faces; ++f) {
    for (int k = 0; k < 3; ++k) {
      int& known = number[static_cast<std::size_t>(corners.find(3 * f + k))];
      if (known < 0) {
        known = static_cast<int>(result.source.size());
        result.source.push_back(topology.faces(f, k));
      }
      result.faces(f, k) = known;
    }
    int& panel = panel_number[static_cast<std::size_t>(panels.find(f))];
    if (panel < 0) {
      panel = result.panel_count++;
    }
    result.panels[static_cast<std::size_t>(f)] = panel;
  }
  return result;
}

std::vector<char> cut_between_labels(const Topology& topology, const std::vector<int>& labels) {
  ATELIER_CHECK(static_cast<Index>(labels.size()) == topology.faces.rows(),
                "a label for each face");
  std::vector<char> cut(static_cast<std::size_t>(topology.edges.rows()), 0);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto sharing = corners_of_edge(topology, e);
    cut[static_cast<std::size_t>(e)] =
        sharing.size() == 2 && labels[static_cast<std::size_t>(sharing[0] / 3)] !=
                                   labels[static_cast<std::size_t>(sharing[1] / 3)]
            ? 1
            : 0;
  }
  return cut;
}

std::vector<char> cut_at_edges(const Topology& topology,
                               const std::vector<std::pair<int, int>>& ends) {
  std::vector<char> cut(static_cast<std::size_t>(topology.edges.rows()), 0);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const std::array<int, 2> edge{std::min(ends[i].first, ends[i].second),
                                  std::max(ends[i].first, ends[i].second)};
    // Edges are in lexicographic order.
    Index low = 0;
    Index high = topology.edges.rows();
    while (low < high) {
      const Index middle = (low + high) / 2;
      const std::array<int, 2> here{topology.edges(middle, 0), topology.edges(middle, 1)};
      (here < edge ? low : high) = here < edge ? middle + 1 : middle;
    }
    if (low == topology.edges.rows() || topology.edges(low, 0) != edge[0] ||
        topology.edges(low, 1) != edge[1]) {
      throw DataError(
          "", "seam edge " + std::to_string(i),
          "vertices " + std::to_string(ends[i].first) + " and " + std::to_string(ends[i].second),
          "the ends of an edge of the mesh");
    }
    cut[static_cast<std::size_t>(low)] = 1;
  }
  return cut;
}

}  // namespace atelier
