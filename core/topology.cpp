#include "core/topology.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <string>
#include <tuple>

#include "core/error.h"

namespace atelier {
namespace {

struct DirectedEdge {
  int low;
  int high;
  int corner;  // 3 * face + k

  bool operator<(const DirectedEdge& other) const {
    return std::tie(low, high, corner) < std::tie(other.low, other.high, other.corner);
  }
};

bool degenerate(const Triangles& faces, Index f) {
  return faces(f, 0) == faces(f, 1) || faces(f, 1) == faces(f, 2) || faces(f, 2) == faces(f, 0);
}

/// The vertex from which this corner's edge starts.
int start_of(const Topology& topology, int corner) {
  return topology.faces(corner / 3, corner % 3);
}

/// The vertex at which this corner's edge ends.
int end_of(const Topology& topology, int corner) {
  return topology.faces(corner / 3, (corner % 3 + 1) % 3);
}

/// Groups that are merged step by step; the smallest member names its group.
struct UnionFind {
  explicit UnionFind(std::size_t n) : parent(n) { std::iota(parent.begin(), parent.end(), 0); }

  int find(int i) {
    while (parent[i] != i) {
      parent[i] = parent[parent[i]];
      i = parent[i];
    }
    return i;
  }
  void join(int a, int b) {
    a = find(a);
    b = find(b);
    parent[std::max(a, b)] = std::min(a, b);
  }

  std::vector<int> parent;
};

/// Rows from (row, item) pairs.
Adjacency adjacency_of(std::vector<std::pair<int, int>> pairs, Index rows) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  Adjacency adjacency;
  adjacency.offsets.assign(static_cast<std::size_t>(rows) + 1, 0);
  adjacency.items.reserve(pairs.size());
  for (const auto& [row, item] : pairs) {
    ++adjacency.offsets[row + 1];
    adjacency.items.push_back(item);
  }
  std::partial_sum(adjacency.offsets.begin(), adjacency.offsets.end(), adjacency.offsets.begin());
  return adjacency;
}

}  // namespace

Topology topology_of(const Triangles& faces, Index vertex_count) {
  ATELIER_CHECK(faces.rows() == 0 || (faces.minCoeff() >= 0 && faces.maxCoeff() < vertex_count),
                "a face names a vertex that is not there");
  Topology topology;
  topology.vertex_count = vertex_count;
  topology.faces = faces;
  topology.face_edges = Triangles::Constant(faces.rows(), 3, -1);

  std::vector<DirectedEdge> directed;
  directed.reserve(static_cast<std::size_t>(faces.rows()) * 3);
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, k);
      const int b = faces(f, (k + 1) % 3);
      if (a != b) {
        directed.push_back({std::min(a, b), std::max(a, b), static_cast<int>(3 * f) + k});
      }
    }
  }
  std::sort(directed.begin(), directed.end());

  std::vector<std::array<int, 2>> edges;
  topology.edge_corners.reserve(directed.size());
  for (const DirectedEdge& edge : directed) {
    if (edges.empty() || edges.back() != std::array{edge.low, edge.high}) {
      topology.edge_offsets.push_back(static_cast<int>(topology.edge_corners.size()));
      edges.push_back({edge.low, edge.high});
    }
    topology.face_edges(edge.corner / 3, edge.corner % 3) = static_cast<int>(edges.size()) - 1;
    topology.edge_corners.push_back(edge.corner);
  }
  topology.edge_offsets.push_back(static_cast<int>(topology.edge_corners.size()));
  topology.edges.resize(static_cast<Index>(edges.size()), 2);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    topology.edges.row(static_cast<Index>(e)) << edges[e][0], edges[e][1];
  }
  return topology;
}

Triangles face_neighbors(const Topology& topology) {
  Triangles neighbors = Triangles::Constant(topology.faces.rows(), 3, -1);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto corners = corners_of_edge(topology, e);
    if (corners.size() == 2) {
      neighbors(corners[0] / 3, corners[0] % 3) = corners[1] / 3;
      neighbors(corners[1] / 3, corners[1] % 3) = corners[0] / 3;
    }
  }
  return neighbors;
}

Adjacency vertex_neighbors(const Topology& topology) {
  std::vector<std::pair<int, int>> pairs;
  pairs.reserve(static_cast<std::size_t>(topology.edges.rows()) * 2);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    pairs.emplace_back(topology.edges(e, 0), topology.edges(e, 1));
    pairs.emplace_back(topology.edges(e, 1), topology.edges(e, 0));
  }
  return adjacency_of(std::move(pairs), topology.vertex_count);
}

Adjacency vertex_faces(const Topology& topology) {
  std::vector<std::pair<int, int>> pairs;
  pairs.reserve(static_cast<std::size_t>(topology.faces.rows()) * 3);
  for (Index f = 0; f < topology.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      pairs.emplace_back(topology.faces(f, k), static_cast<int>(f));
    }
  }
  return adjacency_of(std::move(pairs), topology.vertex_count);
}

std::vector<std::vector<int>> boundary_loops(const Topology& topology) {
  // Outgoing boundary corners of each vertex.
  std::vector<std::pair<int, int>> pairs;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto corners = corners_of_edge(topology, e);
    if (corners.size() == 1) {
      pairs.emplace_back(start_of(topology, corners[0]), corners[0]);
    }
  }
  const Adjacency outgoing = adjacency_of(std::move(pairs), topology.vertex_count);
  std::vector<int> used(static_cast<std::size_t>(topology.vertex_count), 0);       // of each row
  std::vector<int> position(static_cast<std::size_t>(topology.vertex_count), -1);  // in the run

  std::vector<std::vector<int>> loops;
  for (Index start = 0; start < topology.vertex_count; ++start) {
    while (used[start] < static_cast<int>(outgoing[start].size())) {
      // Walk on; each time the run comes back to a vertex on it, that part is a loop of its own.
      std::vector<int> run;
      int vertex = static_cast<int>(start);
      while (true) {
        if (position[vertex] >= 0) {
          std::vector<int> loop(run.begin() + position[vertex], run.end());
          run.resize(static_cast<std::size_t>(position[vertex]));
          for (const int v : loop) {
            position[v] = -1;
          }
          std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
          loops.push_back(std::move(loop));
        }
        const auto corners = outgoing[vertex];
        if (used[vertex] == static_cast<int>(corners.size())) {
          break;
        }
        position[vertex] = static_cast<int>(run.size());
        run.push_back(vertex);
        vertex = end_of(topology, corners[used[vertex]++]);
      }
      for (const int v : run) {
        position[v] = -1;
      }
    }
  }
  std::sort(loops.begin(), loops.end());
  return loops;
}

Components connected_components(const Topology& topology) {
  UnionFind groups(static_cast<std::size_t>(topology.vertex_count));
  for (Index f = 0; f < topology.faces.rows(); ++f) {
    groups.join(topology.faces(f, 0), topology.faces(f, 1));
    groups.join(topology.faces(f, 0), topology.faces(f, 2));
  }
  Components components;
  components.of_vertex.resize(static_cast<std::size_t>(topology.vertex_count));
  for (int v = 0; v < static_cast<int>(topology.vertex_count); ++v) {
    const int root = groups.find(v);  // the smallest vertex of the component, seen before
    components.of_vertex[v] = root == v ? components.count++ : components.of_vertex[root];
  }
  components.of_face.resize(static_cast<std::size_t>(topology.faces.rows()));
  for (Index f = 0; f < topology.faces.rows(); ++f) {
    components.of_face[f] = components.of_vertex[topology.faces(f, 0)];
  }
  return components;
}

int euler_characteristic(const Topology& topology) {
  std::vector<char> used(static_cast<std::size_t>(topology.vertex_count), 0);
  std::vector<char> used_edge(static_cast<std::size_t>(topology.edges.rows()), 0);
  int faces = 0;
  for (Index f = 0; f < topology.faces.rows(); ++f) {
    if (!degenerate(topology.faces, f)) {
      ++faces;
      for (int k = 0; k < 3; ++k) {
        used[topology.faces(f, k)] = 1;
        used_edge[topology.face_edges(f, k)] = 1;
      }
    }
  }
  const auto vertices = std::count(used.begin(), used.end(), 1);
  const auto edges = std::count(used_edge.begin(), used_edge.end(), 1);
  return static_cast<int>(vertices - edges) + faces;
}

ManifoldDefects manifold_defects(const Topology& topology) {
  ManifoldDefects defects;
  const Triangles& faces = topology.faces;

  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto corners = corners_of_edge(topology, e);
    if (corners.size() > 2) {
      defects.non_manifold_edges.push_back(static_cast<int>(e));
    } else if (corners.size() == 2 &&
               start_of(topology, corners[0]) == start_of(topology, corners[1])) {
      defects.inconsistent_edges.push_back(static_cast<int>(e));
    }
  }

  std::vector<std::array<int, 4>> sorted_faces;  // three vertices, then the face
  sorted_faces.reserve(static_cast<std::size_t>(faces.rows()));
  for (Index f = 0; f < faces.rows(); ++f) {
    if (degenerate(faces, f)) {
      defects.degenerate_faces.push_back(static_cast<int>(f));
    }
    std::array<int, 4> key = {faces(f, 0), faces(f, 1), faces(f, 2), static_cast<int>(f)};
    std::sort(key.begin(), key.begin() + 3);
    sorted_faces.push_back(key);
  }
  std::sort(sorted_faces.begin(), sorted_faces.end());
  for (std::size_t i = 1; i < sorted_faces.size(); ++i) {
    if (std::equal(sorted_faces[i].begin(), sorted_faces[i].begin() + 3,
                   sorted_faces[i - 1].begin())) {
      defects.duplicate_faces.push_back(sorted_faces[i][3]);
    }
  }
  std::sort(defects.duplicate_faces.begin(), defects.duplicate_faces.end());

  // The corners of a vertex are one fan if they are joined through the edges at that vertex. A
  // corner is the vertex it starts from; crossing an edge leads to the corner of the next face at
  // the same vertex.
  UnionFind fans(static_cast<std::size_t>(faces.rows()) * 3);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto corners = corners_of_edge(topology, e);
    for (std::size_t i = 1; i < corners.size(); ++i) {
      for (const int vertex : {topology.edges(e, 0), topology.edges(e, 1)}) {
        const auto at_vertex = [&](int corner) {
          const int next = 3 * (corner / 3) + (corner % 3 + 1) % 3;
          return start_of(topology, corner) == vertex ? corner : next;
        };
        fans.join(at_vertex(corners[0]), at_vertex(corners[i]));
      }
    }
  }
  std::vector<int> fan_of_vertex(static_cast<std::size_t>(topology.vertex_count), -1);
  std::vector<char> branches(static_cast<std::size_t>(topology.vertex_count), 0);
  for (int corner = 0; corner < static_cast<int>(faces.rows()) * 3; ++corner) {
    const int vertex = start_of(topology, corner);
    if (degenerate(faces, corner / 3)) {
      fan_of_vertex[vertex] = std::max(fan_of_vertex[vertex], 0);  // used, but no fan
      continue;
    }
    const int fan = fans.find(corner) + 1;
    branches[vertex] |= fan_of_vertex[vertex] > 0 && fan_of_vertex[vertex] != fan;
    fan_of_vertex[vertex] = fan;
  }
  for (int v = 0; v < static_cast<int>(topology.vertex_count); ++v) {
    if (branches[v]) {
      defects.non_manifold_vertices.push_back(v);
    }
    if (fan_of_vertex[v] < 0) {
      defects.isolated_vertices.push_back(v);
    }
  }
  return defects;
}

bool is_manifold(const ManifoldDefects& defects) {
  return defects.non_manifold_edges.empty() && defects.non_manifold_vertices.empty() &&
         defects.inconsistent_edges.empty() && defects.duplicate_faces.empty() &&
         defects.degenerate_faces.empty();
}

bool is_closed(const Topology& topology) {
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    if (corners_of_edge(topology, e).size() != 2) {
      return false;
    }
  }
  return true;
}

std::vector<Finding> findings_of(const ManifoldDefects& defects, const Topology& topology) {
  std::vector<Finding> findings;
  const auto vertex_name = [](int v) { return std::to_string(v); };
  const auto edge_name = [&](int e) {
    return std::to_string(topology.edges(e, 0)) + "-" + std::to_string(topology.edges(e, 1));
  };
  const auto add = [&](Severity severity, const char* code, const std::vector<int>& items,
                       const char* one, const char* many, const auto& name, const char* advice) {
    if (items.empty()) {
      return;
    }
    std::string place = items.size() == 1 ? one : many;
    for (std::size_t i = 0; i < std::min<std::size_t>(items.size(), 5); ++i) {
      place += (i == 0 ? " " : ", ") + name(items[i]);
    }
    place += items.size() > 5 ? ", ..." : "";
    findings.push_back({severity, code, place,
                        std::to_string(items.size()) + " " + (items.size() == 1 ? one : many),
                        advice});
  };
  add(Severity::Error, "non-manifold-edge", defects.non_manifold_edges, "edge", "edges", edge_name,
      "part the surface there: an edge has at most two faces");
  add(Severity::Error, "non-manifold-vertex", defects.non_manifold_vertices, "vertex", "vertices",
      vertex_name, "duplicate the vertex: its faces must form one fan");
  add(Severity::Error, "inconsistent-orientation", defects.inconsistent_edges, "edge", "edges",
      edge_name, "flip faces until neighbours run along their edge in opposite directions");
  add(Severity::Error, "degenerate-face", defects.degenerate_faces, "face", "faces", vertex_name,
      "remove the face: it has a vertex more than once");
  add(Severity::Warning, "duplicate-face", defects.duplicate_faces, "face", "faces", vertex_name,
      "remove the face: an earlier one has the same vertices");
  add(Severity::Note, "isolated-vertex", defects.isolated_vertices, "vertex", "vertices",
      vertex_name, "remove the vertex if nothing needs it: no face uses it");
  return findings;
}

}  // namespace atelier
