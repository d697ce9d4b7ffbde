#include "registration/flattening/flat_seams.h"

#include <algorithm>

#include "registration/edge_paths.h"

namespace atelier {
namespace {

/// Cut vertex of corner `of` of a whole vertex in a face.
int cut_vertex(const Topology& topology, const SurfaceCut& cut, int face, int vertex) {
  for (int k = 0; k < 3; ++k) {
    if (topology.faces(face, k) == vertex) {
      return cut.faces(face, k);
    }
  }
  return -1;
}

}  // namespace

std::vector<FlatSeam> flat_seams(const Topology& topology, const std::vector<char>& flags,
                                 const SurfaceCut& cut) {
  const auto is_seam = [&](Index e) {
    return flags[static_cast<std::size_t>(e)] != 0 && corners_of_edge(topology, e).size() == 2;
  };
  const auto count = static_cast<std::size_t>(topology.vertex_count);
  std::vector<int> degree(count, 0);
  std::vector<char> is_end(count, 0);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    for (const int k : {0, 1}) {
      const auto v = static_cast<std::size_t>(topology.edges(e, k));
      degree[v] += is_seam(e) ? 1 : 0;
      is_end[v] = static_cast<char>(is_end[v] | (corners_of_edge(topology, e).size() != 2 ? 1 : 0));
    }
  }
  for (std::size_t v = 0; v < count; ++v) {
    is_end[v] = static_cast<char>(is_end[v] | (degree[v] != 2 ? 1 : 0));
  }
  const EdgeGraph graph(topology);
  std::vector<char> done(flags.size(), 0);
  std::vector<FlatSeam> seams;
  const auto follow = [&](int edge, int from) {
    FlatSeam seam;
    for (int at = from; edge >= 0;) {
      done[static_cast<std::size_t>(edge)] = 1;
      const int to = graph.other_end(edge, at);
      // The face that runs along the edge from `at` to `to` is a's.
      const auto sharing = corners_of_edge(topology, edge);
      const bool first = topology.faces(sharing[0] / 3, sharing[0] % 3) == at;
      const int face_a = sharing[first ? 0 : 1] / 3;
      const int face_b = sharing[first ? 1 : 0] / 3;
      if (seam.a.empty()) {
        seam.panel_a = cut.panels[static_cast<std::size_t>(face_a)];
        seam.panel_b = cut.panels[static_cast<std::size_t>(face_b)];
        seam.a.push_back(cut_vertex(topology, cut, face_a, at));
        seam.b.push_back(cut_vertex(topology, cut, face_b, at));
      }
      seam.a.push_back(cut_vertex(topology, cut, face_a, to));
      seam.b.push_back(cut_vertex(topology, cut, face_b, to));
      at = to;
      edge = -1;
      if (is_end[static_cast<std::size_t>(at)] == 0) {
        for (const int next : graph.edges_of(at)) {
          if (is_seam(next) && done[static_cast<std::size_t>(next)] == 0) {
            edge = next;
          }
        }
      }
    }
    seam.name = "seam" + std::to_string(seams.size() + 1);
    seams.push_back(std::move(seam));
  };
  for (const bool closed : {false, true}) {
    for (Index e = 0; e < topology.edges.rows(); ++e) {
      for (const int k : {0, 1}) {
        const int from = topology.edges(e, k);
        if (is_seam(e) && done[static_cast<std::size_t>(e)] == 0 &&
            (closed || is_end[static_cast<std::size_t>(from)] != 0)) {
          follow(static_cast<int>(e), from);
        }
      }
    }
  }
  return seams;
}

}  // namespace atelier
