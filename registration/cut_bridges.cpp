#include "registration/cut_bridges.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>

#include "core/normals.h"
#include "core/topology.h"
#include "registration/edge_paths.h"
#include "registration/trim_surface.h"

namespace atelier {
namespace {

constexpr int kPlaces = 200;         // from which loops are sought
constexpr double kLeastPiece = 0.1;  // of the largest's area

/// The surface with a lid on each opening, whose middle is a vertex beyond its own: closed, so that
/// a loop round an opening is none of a handle.
Triangles with_lids(const Triangles& faces, Index vertices,
                    const std::vector<std::vector<int>>& openings) {
  Index lids = 0;
  for (const std::vector<int>& loop : openings) {
    lids += std::ssize(loop);
  }
  Triangles closed(faces.rows() + lids, 3);
  closed.topRows(faces.rows()) = faces;
  Index f = faces.rows();
  for (std::size_t i = 0; i < openings.size(); ++i) {
    const std::vector<int>& loop = openings[i];
    for (std::size_t k = 0; k < loop.size(); ++k) {
      closed.row(f++) << loop[(k + 1) % loop.size()], loop[k],
          static_cast<int>(vertices) + static_cast<int>(i);
    }
  }
  return closed;
}

struct Loop {
  std::vector<int> vertices;
  double length = std::numeric_limits<double>::infinity();  // m
};

int root_of(std::vector<int>& parents, int i) {
  while (parents[static_cast<std::size_t>(i)] != i) {
    i = parents[static_cast<std::size_t>(i)] =
        parents[static_cast<std::size_t>(parents[static_cast<std::size_t>(i)])];
  }
  return i;
}

/// Edges that close a loop round a handle, each with the ways back to where the tree begins: those
/// neither in the tree of ways nor needed to join all faces.
std::vector<int> handle_edges(const Topology& topology, const EdgePaths& paths,
                              const std::vector<double>& costs) {
  std::vector<char> in_tree(costs.size(), 0);
  for (const int parent : paths.parents) {
    if (parent >= 0) {
      in_tree[static_cast<std::size_t>(parent)] = 1;
    }
  }
  std::vector<std::pair<double, int>> rest;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    if (in_tree[static_cast<std::size_t>(e)] == 0) {
      rest.emplace_back(paths.distances[static_cast<std::size_t>(topology.edges(e, 0))] +
                            paths.distances[static_cast<std::size_t>(topology.edges(e, 1))] +
                            costs[static_cast<std::size_t>(e)],
                        static_cast<int>(e));
    }
  }
  // The longest join faces, so that the shortest are left.
  std::sort(rest.rbegin(), rest.rend());
  std::vector<int> joined(static_cast<std::size_t>(topology.faces.rows()));
  std::iota(joined.begin(), joined.end(), 0);
  std::vector<int> left;
  for (const auto& [length, edge] : rest) {
    const auto sharing = corners_of_edge(topology, edge);
    const int a = root_of(joined, sharing[0] / 3);
    const int b = root_of(joined, sharing[1] / 3);
    if (a == b) {
      left.push_back(edge);
    } else {
      joined[static_cast<std::size_t>(a)] = b;
    }
  }
  return left;
}

/// The loop of an edge and of its ends' ways back, without what both have in common.
Loop loop_of(const Topology& topology, const EdgeGraph& graph, const EdgePaths& paths, int edge,
             const std::vector<double>& costs) {
  std::vector<int> one = graph.way_back(paths, topology.edges(edge, 0));
  std::vector<int> other = graph.way_back(paths, topology.edges(edge, 1));
  while (!one.empty() && !other.empty() && one.back() == other.back()) {
    one.pop_back();
    other.pop_back();
  }
  Loop loop;
  loop.length = costs[static_cast<std::size_t>(edge)];
  loop.vertices = {topology.edges(edge, 0), topology.edges(edge, 1)};
  for (const std::vector<int>& way : {one, other}) {
    for (const int e : way) {
      loop.length += costs[static_cast<std::size_t>(e)];
      loop.vertices.push_back(topology.edges(e, 0));
      loop.vertices.push_back(topology.edges(e, 1));
    }
  }
  std::sort(loop.vertices.begin(), loop.vertices.end());
  loop.vertices.erase(std::unique(loop.vertices.begin(), loop.vertices.end()), loop.vertices.end());
  return loop;
}

/// A loop goes round what is behind the surface where the surface looks away from its middle.
bool is_round_the_inside(const Loop& loop, const Points& vertices, const Points& normals) {
  const Eigen::RowVector3d middle = vertices(loop.vertices, Eigen::all).colwise().mean();
  double outwards = 0;
  for (const int v : loop.vertices) {
    outwards += (vertices.row(v) - middle).normalized().dot(normals.row(v));
  }
  return outwards > 0;
}

std::optional<Loop> shortest_bridge(const Mesh& mesh, const Topology& open, double longest) {
  const std::vector<std::vector<int>> openings = boundary_loops(open);
  const Index vertices = mesh.vertices.rows();
  const Topology topology = topology_of(with_lids(mesh.faces, vertices, openings),
                                        vertices + static_cast<Index>(openings.size()));
  std::vector<char> at_opening(static_cast<std::size_t>(topology.vertex_count), 0);
  for (const std::vector<int>& loop : openings) {
    for (const int v : loop) {
      at_opening[static_cast<std::size_t>(v)] = 1;
    }
  }
  // And those beside it: faces at the loop go.
  const std::vector<char> rim = at_opening;
  for (Index e = 0; e < open.edges.rows(); ++e) {
    const auto a = static_cast<std::size_t>(open.edges(e, 0));
    const auto b = static_cast<std::size_t>(open.edges(e, 1));
    at_opening[a] = static_cast<char>(at_opening[a] | rim[b]);
    at_opening[b] = static_cast<char>(at_opening[b] | rim[a]);
  }
  std::vector<double> costs(static_cast<std::size_t>(topology.edges.rows()));
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    constexpr double kOverALid = 1e3;      // m: no way leads there
    constexpr double kAlongAnOpening = 4;  // times as long: a cut there would widen it
    const int a = topology.edges(e, 0);
    const int b = topology.edges(e, 1);  // the larger, so that lids' middles are
    double& cost = costs[static_cast<std::size_t>(e)];
    cost = b < vertices ? (mesh.vertices.row(a) - mesh.vertices.row(b)).norm() : kOverALid;
    if (at_opening[static_cast<std::size_t>(a)] != 0 ||
        at_opening[static_cast<std::size_t>(b)] != 0) {
      cost *= kAlongAnOpening;
    }
  }
  const Points normals = vertex_normals(mesh.vertices, mesh.faces);
  const EdgeGraph graph(topology);
  Loop best;
  const Index step = std::max<Index>(1, vertices / kPlaces);
  for (Index v = 0; v < vertices; v += step) {
    const EdgePaths paths = graph.paths_from({static_cast<int>(v)}, costs);
    for (const int edge : handle_edges(topology, paths, costs)) {
      Loop loop = loop_of(topology, graph, paths, edge, costs);
      if (loop.length < std::min(best.length, longest) &&
          is_round_the_inside(loop, mesh.vertices, normals)) {
        best = std::move(loop);
      }
    }
  }
  return best.vertices.empty() ? std::nullopt : std::optional(std::move(best));
}

Triangles faces_without(const Triangles& faces, Index vertex_count,
                        const std::vector<int>& vertices) {
  std::vector<char> gone(static_cast<std::size_t>(vertex_count), 0);
  for (const int v : vertices) {
    gone[static_cast<std::size_t>(v)] = 1;
  }
  std::vector<Index> kept;
  for (Index f = 0; f < faces.rows(); ++f) {
    const auto at = [&](int k) { return gone[static_cast<std::size_t>(faces(f, k))]; };
    if (at(0) == 0 && at(1) == 0 && at(2) == 0) {
      kept.push_back(f);
    }
  }
  return faces(kept, Eigen::all);
}

int handles_of(const Topology& topology) {
  return (2 - static_cast<int>(boundary_loops(topology).size()) - euler_characteristic(topology)) /
         2;
}

}  // namespace

CutBridges cut_bridges(const Mesh& mesh, double longest) {
  CutBridges cut{mesh};
  Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  for (int handles = handles_of(topology); handles > 0;) {
    const std::optional<Loop> bridge = shortest_bridge(cut.mesh, topology, longest);
    if (!bridge) {
      break;
    }
    std::vector<int> gone = bridge->vertices;
    while (!gone.empty()) {
      cut.mesh.faces = faces_without(cut.mesh.faces, cut.mesh.vertices.rows(), gone);
      topology = topology_of(cut.mesh.faces, cut.mesh.vertices.rows());
      gone = manifold_defects(topology).non_manifold_vertices;  // where a narrow one leaves a touch
    }
    cut.mesh = without_small_pieces(cut.mesh, kLeastPiece);
    topology = topology_of(cut.mesh.faces, cut.mesh.vertices.rows());
    ++cut.count;
    const int left = handles_of(topology);
    if (left >= handles) {
      break;
    }
    handles = left;
  }
  return cut;
}

}  // namespace atelier
