#include "registration/flattening/mirrored_way.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr double kNoWay = std::numeric_limits<double>::infinity();

/// Distance of a point from a chain of segments, m.
double off_chain(const Points& chain, const Eigen::RowVector3d& point) {
  double least = kNoWay;
  for (Index i = 0; i + 1 < chain.rows(); ++i) {
    const Eigen::RowVector3d a = chain.row(i);
    const Eigen::RowVector3d ab = chain.row(i + 1) - a;
    const double t = std::clamp((point - a).dot(ab) / std::max(ab.squaredNorm(), 1e-18), 0.0, 1.0);
    least = std::min(least, (point - a - t * ab).norm());
  }
  return least;
}

int nearest_of(const Points& vertices, const std::vector<int>& among,
               const Eigen::RowVector3d& point) {
  return *std::min_element(among.begin(), among.end(), [&](int a, int b) {
    return (vertices.row(a) - point).squaredNorm() < (vertices.row(b) - point).squaredNorm();
  });
}

std::vector<int> inner_vertices(const SeamPiece& piece, const std::vector<int>& rim) {
  std::vector<char> on_rim(static_cast<std::size_t>(piece.vertices.rows()), 0);
  for (const int v : rim) {
    on_rim[static_cast<std::size_t>(v)] = 1;
  }
  std::vector<int> inner;
  for (int v = 0; v < static_cast<int>(on_rim.size()); ++v) {
    if (on_rim[static_cast<std::size_t>(v)] == 0) {
      inner.push_back(v);
    }
  }
  return inner;
}

/// The way near `image` through one piece, and how far it strays from it in the mean.
std::pair<std::vector<int>, double> way_near(const SeamPiece& piece, const Points& image,
                                             bool to_rim) {
  constexpr double kStray = 0.005;  // m that costs as much again
  const std::vector<int> rim = boundary_loops(piece.topology).front();
  const std::vector<int> inner = inner_vertices(piece, rim);
  const int first = nearest_of(piece.vertices, rim, image.row(0));
  if (!to_rim && inner.empty()) {
    return {{}, kNoWay};
  }
  const int last = nearest_of(piece.vertices, to_rim ? rim : inner, image.row(image.rows() - 1));
  if (first == last) {
    return {{}, kNoWay};
  }
  std::vector<char> on_rim(static_cast<std::size_t>(piece.vertices.rows()), 0);
  for (const int v : rim) {
    on_rim[static_cast<std::size_t>(v)] = v == first || v == last ? 0 : 1;
  }
  const std::vector<double> lengths = edge_lengths(piece.topology, piece.vertices);
  std::vector<double> costs(lengths.size());
  std::vector<double> strays(lengths.size());
  for (Index e = 0; e < piece.topology.edges.rows(); ++e) {
    const auto at = static_cast<std::size_t>(e);
    const int a = piece.topology.edges(e, 0);
    const int b = piece.topology.edges(e, 1);
    strays[at] = off_chain(image, (piece.vertices.row(a) + piece.vertices.row(b)) / 2);
    const bool inside = corners_of_edge(piece.topology, e).size() == 2 &&
                        on_rim[static_cast<std::size_t>(a)] == 0 &&
                        on_rim[static_cast<std::size_t>(b)] == 0;
    costs[at] = inside ? lengths[at] * (1 + std::pow(strays[at] / kStray, 2)) : kNoWay;
  }
  const EdgeGraph graph(piece.topology);
  const EdgePaths paths = graph.paths_from({first}, costs);
  if (!std::isfinite(paths.distances[static_cast<std::size_t>(last)])) {
    return {{}, kNoWay};
  }
  std::vector<int> way = graph.way_back(paths, last);
  double stray = 0;
  double length = 0;
  for (const int e : way) {
    stray += lengths[static_cast<std::size_t>(e)] * strays[static_cast<std::size_t>(e)];
    length += lengths[static_cast<std::size_t>(e)];
  }
  // Ends count as well: the image may go on where the piece does not.
  const double ends = ((piece.vertices.row(first) - image.row(0)).norm() +
                       (piece.vertices.row(last) - image.row(image.rows() - 1)).norm()) /
                      2;
  return {std::move(way), std::max(stray / std::max(length, 1e-12), ends)};
}

}  // namespace

MirrorPlane mirror_plane(const Mesh& mesh, const Eigen::Vector3d& facing) {
  constexpr double kAlike = 0.015;  // m
  MirrorPlane plane;
  plane.left = Eigen::Vector3d::UnitY().cross(facing);
  const Eigen::VectorXd across = mesh.vertices * plane.left;
  plane.middle = (across.minCoeff() + across.maxCoeff()) / 2;
  Points image = mesh.vertices;
  for (Index v = 0; v < image.rows(); ++v) {
    image.row(v) -= 2 * (across[v] - plane.middle) * plane.left.transpose();
  }
  const std::vector<ClosestPoint> nearest =
      closest_points(build_tree(mesh.vertices, mesh.faces), image);
  const auto alike = std::count_if(nearest.begin(), nearest.end(), [&](const ClosestPoint& point) {
    return point.squared_distance < kAlike * kAlike;
  });
  plane.holds = 2 * alike >= image.rows();
  return plane;
}

std::vector<int> chain_of(const Topology& topology, const std::vector<int>& edges) {
  std::vector<std::vector<int>> of_vertex(static_cast<std::size_t>(topology.vertex_count));
  for (const int e : edges) {
    for (const int k : {0, 1}) {
      of_vertex[static_cast<std::size_t>(topology.edges(e, k))].push_back(e);
    }
  }
  int first = -1;
  for (std::size_t v = 0; v < of_vertex.size(); ++v) {
    if (of_vertex[v].size() > 2) {
      return {};
    }
    if (of_vertex[v].size() == 1 && first < 0) {
      first = static_cast<int>(v);
    }
  }
  if (first < 0) {
    return {};
  }
  std::vector<int> chain{first};
  for (int came_by = -1;;) {
    const std::vector<int>& here = of_vertex[static_cast<std::size_t>(chain.back())];
    const auto next = std::find_if(here.begin(), here.end(), [&](int e) { return e != came_by; });
    if (next == here.end()) {
      break;
    }
    came_by = *next;
    chain.push_back(topology.edges(came_by, 0) == chain.back() ? topology.edges(came_by, 1)
                                                               : topology.edges(came_by, 0));
  }
  return chain.size() == edges.size() + 1 ? chain : std::vector<int>{};
}

MirroredWay mirrored_way(const std::vector<SeamPiece>& pieces, const MirrorPlane& plane,
                         const Points& chain, bool to_rim) {
  ATELIER_CHECK(chain.rows() >= 2, "a chain of two places or more");
  constexpr double kItself = 0.015;  // m
  constexpr double kStrayed = 0.02;  // m
  Points image = chain;
  double off_itself = 0;
  for (Index i = 0; i < chain.rows(); ++i) {
    image.row(i) -= 2 * (chain.row(i).dot(plane.left) - plane.middle) * plane.left.transpose();
  }
  for (Index i = 0; i < chain.rows(); ++i) {
    off_itself += off_chain(chain, image.row(i)) / static_cast<double>(chain.rows());
  }
  MirroredWay best;
  if (off_itself < kItself) {
    return best;
  }
  double least = kStrayed;
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    auto [way, stray] = way_near(pieces[p], image, to_rim);
    if (stray < least && !way.empty()) {
      least = stray;
      best = {p, std::move(way)};
    }
  }
  return best;
}

}  // namespace atelier
