#include "registration/flattening/straight_seams.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/normals.h"
#include "core/topology.h"
#include "core/tree.h"
#include "registration/remove_slivers.h"

namespace atelier {
namespace {

constexpr int kBesideSeam = 4;  // of vertices beside a seam that give way

/// A point of the surface as it curves between its vertices (Boubekeur and Alexa, "Phong
/// tessellation", 2008): on the triangles themselves each slide would cut through what bulges.
Eigen::RowVector3d curved_point(const Mesh& mesh, const Points& normals,
                                const ClosestPoint& place) {
  constexpr double kCurved = 0.75;  // the paper's
  Eigen::RowVector3d curved = Eigen::RowVector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const int v = mesh.faces(place.face, k);
    const Eigen::RowVector3d normal = normals.row(v);
    const Eigen::RowVector3d off = mesh.vertices.row(v) - place.point.transpose();
    curved += place.barycentric[k] * (place.point.transpose() + off.dot(normal) * normal);
  }
  return (1 - kCurved) * place.point.transpose() + kCurved * curved;
}

/// Area over what an equilateral triangle of the same sum of squared edges has: 1 at most.
double triangle_evenness(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                         const Eigen::Vector3d& c) {
  const double squares = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return squares > 0 ? 2 * std::sqrt(3.0) * (b - a).cross(c - a).norm() / squares : 0;
}

/// Which neighbours each vertex is drawn to: those in its seam, or all; none where it stays.
Adjacency drawn_in_seams(const Topology& topology, const std::vector<char>& cut) {
  const auto count = static_cast<std::size_t>(topology.vertex_count);
  std::vector<std::vector<int>> along(count);
  std::vector<char> stays(count, 0);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const int a = topology.edges(e, 0);
    const int b = topology.edges(e, 1);
    if (corners_of_edge(topology, e).size() != 2) {
      stays[static_cast<std::size_t>(a)] = stays[static_cast<std::size_t>(b)] = 1;
    } else if (cut[static_cast<std::size_t>(e)] != 0) {
      along[static_cast<std::size_t>(a)].push_back(b);
      along[static_cast<std::size_t>(b)].push_back(a);
    }
  }
  const Adjacency beside = vertex_neighbors(topology);
  std::vector<int> rings(count, kBesideSeam + 1);  // edges from the nearest seam
  std::vector<int> queue;
  for (std::size_t v = 0; v < count; ++v) {
    if (!along[v].empty()) {
      rings[v] = 0;
      queue.push_back(static_cast<int>(v));
    }
  }
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const int ring = rings[static_cast<std::size_t>(queue[i])] + 1;
    for (const int w : beside[queue[i]]) {
      if (ring <= kBesideSeam && rings[static_cast<std::size_t>(w)] > ring) {
        rings[static_cast<std::size_t>(w)] = ring;
        queue.push_back(w);
      }
    }
  }
  Adjacency result;
  result.offsets.push_back(0);
  for (std::size_t v = 0; v < count; ++v) {
    const bool tip = along[v].size() == 1;
    if (stays[v] == 0 && !tip && rings[v] <= kBesideSeam) {
      const std::span<const int> all = beside[static_cast<Index>(v)];
      const std::span<const int> neighbors =
          along[v].empty() ? all : std::span<const int>(along[v]);
      result.items.insert(result.items.end(), neighbors.begin(), neighbors.end());
    }
    result.offsets.push_back(static_cast<int>(result.items.size()));
  }
  return result;
}

}  // namespace

Points straightened_seams(const Mesh& mesh, const std::vector<char>& cut, int rounds) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  ATELIER_CHECK(static_cast<Index>(cut.size()) == topology.edges.rows(), "a flag for each edge");
  const Adjacency drawn = drawn_in_seams(topology, cut);
  const Adjacency around = vertex_faces(topology);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  const Points smooth = vertex_normals(mesh.vertices, mesh.faces);
  Points points = mesh.vertices;
  const auto corner = [&](int face, int k) {
    return Eigen::Vector3d(points.row(mesh.faces(face, k)));
  };
  std::vector<Eigen::Vector3d> normals;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const int face = static_cast<int>(f);
    normals.push_back(
        (corner(face, 1) - corner(face, 0)).cross(corner(face, 2) - corner(face, 0)).normalized());
  }
  const auto worst_around = [&](Index v) {
    double worst = 1;
    for (const int face : around[v]) {
      worst = std::min(worst, triangle_evenness(corner(face, 0), corner(face, 1), corner(face, 2)));
    }
    return worst;
  };
  const auto corner_around = [&](Index v) {
    double smallest = 180;
    for (const int face : around[v]) {
      smallest = std::min(smallest, min_corner(corner(face, 0), corner(face, 1), corner(face, 2)));
    }
    return smallest;
  };
  const auto turned = [&](Index v) {
    return std::any_of(around[v].begin(), around[v].end(), [&](int face) {
      const Eigen::Vector3d normal =
          (corner(face, 1) - corner(face, 0)).cross(corner(face, 2) - corner(face, 0));
      return !(normal.dot(normals[static_cast<std::size_t>(face)]) > 0.5 * normal.norm());
    });
  };
  for (int round = 0; round < rounds; ++round) {
    for (Index v = 0; v < drawn.rows(); ++v) {
      if (drawn[v].empty()) {
        continue;
      }
      const Eigen::RowVector3d before = points.row(v);
      const double even = worst_around(v);
      const double corner_before = corner_around(v);
      Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
      for (const int w : drawn[v]) {
        middle += points.row(w) / static_cast<double>(drawn[v].size());
      }
      points.row(v) =
          curved_point(mesh, smooth, closest_point(tree, (before + middle).transpose() / 2));
      constexpr double kSliver = 1.0 / 3;     // a corner of 11 degrees or more
      constexpr double kSmallestCorner = 10;  // deg
      if (turned(v) || worst_around(v) < std::min(even, kSliver) ||
          corner_around(v) < std::min(corner_before, kSmallestCorner)) {
        points.row(v) = before;
      }
    }
  }
  return points;
}

}  // namespace atelier
