#include "registration/remove_handles.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/topology.h"
#include "registration/edge_paths.h"
#include "registration/rim_vertices.h"

namespace atelier {
namespace {

/// The surface with a fan over each of its openings.
Topology lidded(const Topology& open) {
  Index count = open.faces.rows();
  int tip = static_cast<int>(open.vertex_count);
  Triangles faces = open.faces;
  for (const std::vector<int>& loop : boundary_loops(open)) {
    faces.conservativeResize(count + static_cast<Index>(loop.size()), 3);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      faces.row(count++) << loop[(i + 1) % loop.size()], loop[i], tip;
    }
    ++tip;
  }
  return topology_of(faces, tip);
}

/// One set for each of `count` things; things of one set are joined.
class JoinedSets {
 public:
  explicit JoinedSets(Index count) : parents_(static_cast<std::size_t>(count)) {
    for (std::size_t i = 0; i < parents_.size(); ++i) {
      parents_[i] = static_cast<int>(i);
    }
  }
  /// False if they were joined.
  bool join(int a, int b) {
    a = root(a);
    b = root(b);
    parents_[static_cast<std::size_t>(a)] = b;
    return a != b;
  }

 private:
  int root(int a) {
    while (parents_[static_cast<std::size_t>(a)] != a) {
      int& parent = parents_[static_cast<std::size_t>(a)];
      parent = parents_[static_cast<std::size_t>(parent)];
      a = parent;
    }
    return a;
  }
  std::vector<int> parents_;
};

/// Which loops of a basis each edge of a closed surface crosses: [E] a bit each, 64 at most; all
/// are 0 where there is no handle.
std::vector<std::uint64_t> crossed_loops(const Topology& closed) {
  constexpr std::size_t kMost = 64;
  const Index edges = closed.edges.rows();
  std::vector<std::uint64_t> crossed(static_cast<std::size_t>(edges), 0);
  std::vector<char> in_tree(static_cast<std::size_t>(edges), 0);
  JoinedSets vertices(closed.vertex_count);
  for (Index e = 0; e < edges; ++e) {
    in_tree[static_cast<std::size_t>(e)] =
        vertices.join(closed.edges(e, 0), closed.edges(e, 1)) ? 1 : 0;
  }
  // Across the other edges a tree of faces; what even that leaves closes a loop of faces.
  JoinedSets faces(closed.faces.rows());
  std::vector<std::vector<std::pair<int, int>>> across(  // face, edge
      static_cast<std::size_t>(closed.faces.rows()));
  std::vector<int> left;
  for (Index e = 0; e < edges; ++e) {
    const auto corners = corners_of_edge(closed, e);
    ATELIER_CHECK(corners.size() == 2, "a manifold");
    const int a = corners[0] / 3;
    const int b = corners[1] / 3;
    const int edge = static_cast<int>(e);
    if (in_tree[static_cast<std::size_t>(e)] != 0) {
      continue;
    }
    if (faces.join(a, b)) {
      across[static_cast<std::size_t>(a)].emplace_back(b, edge);
      across[static_cast<std::size_t>(b)].emplace_back(a, edge);
    } else if (left.size() < kMost) {
      left.push_back(edge);
    }
  }
  for (std::size_t i = 0; i < left.size(); ++i) {
    const auto corners = corners_of_edge(closed, left[i]);
    const int from = corners[0] / 3;
    const int to = corners[1] / 3;
    std::vector<std::pair<int, int>> back(across.size(), {-1, -1});  // face and edge before it
    std::vector<int> queue = {from};
    back[static_cast<std::size_t>(from)] = {from, -1};
    for (std::size_t k = 0; back[static_cast<std::size_t>(to)].first < 0; ++k) {
      ATELIER_CHECK(k < queue.size(), "a tree of faces");
      for (const auto& [face, edge] : across[static_cast<std::size_t>(queue[k])]) {
        if (back[static_cast<std::size_t>(face)].first < 0) {
          back[static_cast<std::size_t>(face)] = {queue[k], edge};
          queue.push_back(face);
        }
      }
    }
    const std::uint64_t bit = std::uint64_t{1} << i;
    crossed[static_cast<std::size_t>(left[i])] ^= bit;
    for (int face = to; face != from; face = back[static_cast<std::size_t>(face)].first) {
      crossed[static_cast<std::size_t>(back[static_cast<std::size_t>(face)].second)] ^= bit;
    }
  }
  return crossed;
}

/// Ways from one vertex as far as is asked; made once, used for every vertex.
struct NearWays {
  std::vector<double> distances;       // [V] infinite where none came
  std::vector<int> parents;            // [V] edge back
  std::vector<std::uint64_t> crossed;  // [V] on the way
  std::vector<int> reached;

  explicit NearWays(Index count)
      : distances(static_cast<std::size_t>(count), std::numeric_limits<double>::infinity()),
        parents(static_cast<std::size_t>(count), -1),
        crossed(static_cast<std::size_t>(count), 0) {}

  /// From `root` over `usable` edges, up to `reach` metres.
  void go(int root, double reach, const EdgeGraph& graph, const std::vector<double>& lengths,
          const std::vector<std::uint64_t>& crossings, const std::vector<char>& usable) {
    for (const int v : reached) {
      distances[static_cast<std::size_t>(v)] = std::numeric_limits<double>::infinity();
      parents[static_cast<std::size_t>(v)] = -1;
    }
    reached.clear();
    using Entry = std::pair<double, int>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    distances[static_cast<std::size_t>(root)] = 0;
    crossed[static_cast<std::size_t>(root)] = 0;
    reached.push_back(root);
    queue.emplace(0, root);
    while (!queue.empty()) {
      const auto [distance, vertex] = queue.top();
      queue.pop();
      if (distance > distances[static_cast<std::size_t>(vertex)]) {
        continue;
      }
      for (const int edge : graph.edges_of(vertex)) {
        const auto other = static_cast<std::size_t>(graph.other_end(edge, vertex));
        const double next = distance + lengths[static_cast<std::size_t>(edge)];
        if (usable[static_cast<std::size_t>(edge)] == 0 || next > reach ||
            next >= distances[other]) {
          continue;
        }
        if (parents[other] < 0) {
          reached.push_back(static_cast<int>(other));
        }
        distances[other] = next;
        parents[other] = edge;
        crossed[other] =
            crossed[static_cast<std::size_t>(vertex)] ^ crossings[static_cast<std::size_t>(edge)];
        queue.emplace(next, static_cast<int>(other));
      }
    }
  }

  /// Vertices from one of those reached back to the root.
  std::vector<int> way_back(int vertex, const EdgeGraph& graph) const {
    std::vector<int> way = {vertex};
    while (parents[static_cast<std::size_t>(way.back())] >= 0) {
      way.push_back(graph.other_end(parents[static_cast<std::size_t>(way.back())], way.back()));
    }
    return way;
  }
};

/// Vertices of the shortest loop that parts nothing, one behind the other; none of `longest` metres
/// or less: empty.
std::vector<int> handle_loop(const Topology& topology, const Points& x,
                             const ManifoldDefects& defects, double longest) {
  const Topology closed = lidded(topology);
  const std::vector<std::uint64_t> all_crossings = crossed_loops(closed);
  if (std::all_of(all_crossings.begin(), all_crossings.end(),
                  [](std::uint64_t bits) { return bits == 0; })) {
    return {};
  }
  std::map<std::pair<int, int>, std::uint64_t> crossings_of;
  for (Index e = 0; e < closed.edges.rows(); ++e) {
    crossings_of[{closed.edges(e, 0), closed.edges(e, 1)}] =
        all_crossings[static_cast<std::size_t>(e)];
  }
  const EdgeGraph graph(topology);
  const std::vector<double> lengths = edge_lengths(topology, x);
  std::vector<char> rim = rim_vertices(topology);
  for (const int v : defects.non_manifold_vertices) {
    rim[static_cast<std::size_t>(v)] = 1;
  }
  std::vector<std::uint64_t> crossings;
  std::vector<char> usable;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const int a = topology.edges(e, 0);
    const int b = topology.edges(e, 1);
    crossings.push_back(crossings_of.at({a, b}));
    usable.push_back(
        rim[static_cast<std::size_t>(a)] == 0 && rim[static_cast<std::size_t>(b)] == 0 ? 1 : 0);
  }
  NearWays ways(topology.vertex_count);
  std::vector<int> loop;
  double best = longest;
  for (int root = 0; root < topology.vertex_count; ++root) {
    if (rim[static_cast<std::size_t>(root)] != 0) {
      continue;
    }
    ways.go(root, best / 2, graph, lengths, crossings, usable);
    for (const int v : ways.reached) {
      for (const int edge : graph.edges_of(v)) {
        const int other = graph.other_end(edge, v);
        const double length = ways.distances[static_cast<std::size_t>(v)] +
                              ways.distances[static_cast<std::size_t>(other)] +
                              lengths[static_cast<std::size_t>(edge)];
        const bool open = (ways.crossed[static_cast<std::size_t>(v)] ^
                           ways.crossed[static_cast<std::size_t>(other)] ^
                           crossings[static_cast<std::size_t>(edge)]) != 0;
        if (usable[static_cast<std::size_t>(edge)] == 0 || !(length < best) || !open) {
          continue;
        }
        std::vector<int> there = ways.way_back(v, graph);
        std::vector<int> back = ways.way_back(other, graph);
        // Edges that both ways share are no part of the loop.
        int shared = there.back();
        while (!there.empty() && !back.empty() && there.back() == back.back()) {
          shared = there.back();
          there.pop_back();
          back.pop_back();
        }
        there.push_back(shared);
        there.insert(there.end(), back.rbegin(), back.rend());
        loop = std::move(there);
        best = length;
      }
    }
  }
  return loop;
}

/// The surface with vertices of a loop doubled: the faces on its left have new ones.
void cut_along(Mesh& mesh, const std::vector<int>& loop) {
  std::map<std::pair<int, int>, int> face_at;  // of a directed edge
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      face_at[{mesh.faces(f, k), mesh.faces(f, (k + 1) % 3)}] = static_cast<int>(f);
    }
  }
  const Index before = mesh.vertices.rows();
  const auto count = static_cast<Index>(loop.size());
  mesh.vertices.conservativeResize(before + count, 3);
  Triangles faces = mesh.faces;
  for (Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const int v = loop[at];
    const int last = loop[(at + loop.size() - 1) % loop.size()];
    mesh.vertices.row(before + i) = mesh.vertices.row(v);
    for (int next = loop[(at + 1) % loop.size()]; next != last;) {
      const int f = face_at.at({v, next});
      for (int k = 0; k < 3; ++k) {
        if (mesh.faces(f, k) == v) {
          faces(f, k) = static_cast<int>(before + i);
          next = mesh.faces(f, (k + 2) % 3);
          break;
        }
      }
    }
  }
  mesh.faces = std::move(faces);
}

}  // namespace

CutHandles remove_handles(Mesh mesh, double longest) {
  CutHandles result;
  for (;;) {
    const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
    const ManifoldDefects defects = manifold_defects(topology);
    ATELIER_CHECK(defects.non_manifold_edges.empty() && defects.inconsistent_edges.empty() &&
                      defects.degenerate_faces.empty(),
                  "an oriented surface of two faces at an edge");
    const std::vector<int> loop = handle_loop(topology, mesh.vertices, defects, longest);
    if (loop.empty()) {
      result.mesh = std::move(mesh);
      return result;
    }
    Mesh bare;
    bare.vertices = std::move(mesh.vertices);
    bare.faces = std::move(mesh.faces);
    cut_along(bare, loop);
    mesh = std::move(bare);
    ++result.cut;
  }
}

}  // namespace atelier
