#include "registration/flattening/loop_across.h"

#include <limits>
#include <queue>
#include <utility>

namespace atelier {
namespace {

constexpr double kNoLoop = std::numeric_limits<double>::infinity();

/// Flags of the edges that leave an arc to the left, [E]. `place`: of each vertex in the arc, or
/// -1.
std::vector<char> left_of_arc(const Topology& topology, const EdgeGraph& graph,
                              const std::vector<int>& arc, const std::vector<int>& place) {
  // Faces to the left of the arc touch an edge of it in its direction; edges into the fan between
  // two arc edges on that side leave it to the left.
  std::vector<char> to_left(static_cast<std::size_t>(topology.edges.rows()), 0);
  const Triangles neighbors = face_neighbors(topology);
  for (std::size_t i = 0; i + 1 < arc.size(); ++i) {
    for (const int e : graph.edges_of(arc[i])) {
      if (graph.other_end(e, arc[i]) != arc[i + 1]) {
        continue;
      }
      for (const int corner : corners_of_edge(topology, e)) {
        if (topology.faces(corner / 3, corner % 3) != arc[i]) {
          continue;  // the face on the right
        }
        // Round each end, from this face on, until the arc goes on.
        for (const int v : {arc[i], arc[i + 1]}) {
          int face = corner / 3;
          int came_by = e;
          for (std::size_t turns = 0; turns < 64 && face >= 0; ++turns) {
            int next_edge = -1;
            int next_face = -1;
            for (int k = 0; k < 3; ++k) {
              const int edge = topology.face_edges(face, k);
              const bool at_v =
                  topology.faces(face, k) == v || topology.faces(face, (k + 1) % 3) == v;
              if (at_v && edge != came_by) {
                next_edge = edge;
                next_face = neighbors(face, k);
              }
            }
            if (next_edge < 0 ||
                place[static_cast<std::size_t>(graph.other_end(next_edge, v))] >= 0) {
              break;
            }
            to_left[static_cast<std::size_t>(next_edge)] = 1;
            came_by = next_edge;
            face = next_face;
          }
        }
      }
    }
  }
  return to_left;
}

}  // namespace

std::vector<int> loop_across(const Topology& topology, const EdgeGraph& graph,
                             const std::vector<int>& arc, int base,
                             const std::vector<double>& costs) {
  constexpr int kLevels = 3;  // crossed -1, 0, 1 times
  const auto count = static_cast<std::size_t>(topology.vertex_count);
  std::vector<int> place(count, -1);
  for (std::size_t i = 0; i < arc.size(); ++i) {
    place[static_cast<std::size_t>(arc[i])] = static_cast<int>(i);
  }
  const std::vector<char> to_left = left_of_arc(topology, graph, arc, place);
  const auto state = [&](int v, int level) {
    return static_cast<std::size_t>(v) * kLevels + static_cast<std::size_t>(level + 1);
  };
  std::vector<double> best(count * kLevels, kNoLoop);
  std::vector<std::pair<int, int>> from(count * kLevels, {-1, 0});  // edge, level
  using Entry = std::pair<double, std::pair<int, int>>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  best[state(base, 0)] = 0;
  queue.push({0, {base, 0}});
  while (!queue.empty()) {
    const auto [cost, at] = queue.top();
    const auto [v, level] = at;
    queue.pop();
    if (cost > best[state(v, level)]) {
      continue;
    }
    if (v == base && level == 1) {
      break;
    }
    for (const int e : graph.edges_of(v)) {
      const int w = graph.other_end(e, v);
      int next = level;
      if (to_left[static_cast<std::size_t>(e)] != 0) {
        next += place[static_cast<std::size_t>(v)] >= 0 ? 1 : -1;
      }
      if (next < -1 || next > 1) {
        continue;
      }
      const double there = cost + costs[static_cast<std::size_t>(e)];
      if (there < best[state(w, next)]) {
        best[state(w, next)] = there;
        from[state(w, next)] = {e, level};
        queue.push({there, {w, next}});
      }
    }
  }
  std::vector<int> loop;
  int v = base;
  int level = 1;
  while (from[state(v, level)].first >= 0 && !(v == base && level == 0)) {
    const auto [edge, before] = from[state(v, level)];
    loop.push_back(edge);
    v = graph.other_end(edge, v);
    level = before;
  }
  return loop;
}

}  // namespace atelier
