#include "registration/template/trim_surface.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/normals.h"
#include "core/part_of_mesh.h"
#include "core/topology.h"
#include "core/tree.h"
#include "core/winding_number.h"
#include "registration/edge_paths.h"
#include "registration/minimum_cut.h"

namespace atelier {
namespace {

enum class Support : char { None, Kept, Carried, Cut, MadeUp };

constexpr double kOffPoint = 0.015;     // m along the normal
constexpr double kBeyondRim = 0.5;      // of the spacing
constexpr double kSameWay = 0.5;        // cosine
constexpr double kNearBody = 0.04;      // m
constexpr double kDeep = 0.01;          // m inside of the body
constexpr double kOpenShare = 0.15;     // of what surrounds a patch
constexpr double kWidestOnBare = 0.05;  // m, of a gap that is open at its ends
constexpr double kWidestOnCloth = 0.2;  // m, where cloth of other frames covers the body below
constexpr double kGoesIn = 0.02;        // m from the rim: less is roughness
constexpr int kSmoothRounds = 12;       // means over neighbours of kept (1) and cut (-1)
constexpr double kPiece = 0.1;          // of the largest piece
constexpr double kCountedArea = 1e-4;   // m2

/// Verdict by each vertex's own place.
struct Supports {
  std::vector<Support> of;
  std::vector<char> between;  ///< 1: supported, but with no point as near as points are apart
};

Supports supports(const Mesh& surface, const GarmentPoints& cloud, double spacing,
                  const Points& body, const Triangles& body_faces, const GarmentCover& cover,
                  const Topology& topology) {
  const Index count = surface.vertices.rows();
  const Points normals = vertex_normals(surface.vertices, surface.faces);
  const TriangleTree tree = build_point_tree(cloud.points);
  const std::vector<ClosestPoint> nearest =
      closest_points(tree, surface.vertices, spacing + kOffPoint);
  const std::vector<ClosestPoint> flesh =
      closest_points(build_tree(body, body_faces), surface.vertices, kNearBody);
  const std::vector<double> winding =
      winding_numbers(build_winding_tree(body, body_faces), surface.vertices);
  Supports all{std::vector<Support>(static_cast<std::size_t>(count), Support::None),
               std::vector<char>(static_cast<std::size_t>(count), 0)};
  std::vector<Support>& result = all.of;
  for (Index v = 0; v < count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    const ClosestPoint& place = flesh[at];
    if (nearest[at].face >= 0) {
      const Index p = nearest[at].face;
      const Eigen::RowVector3d away = surface.vertices.row(v) - cloud.points.row(p);
      const double height = away.dot(cloud.normals.row(p));
      const double beside = (away - height * cloud.normals.row(p)).norm();
      // Invented surface stands on vertices of the body, as far apart as these are.
      const bool made_up = p >= cloud.observed;
      if (beside <= (made_up ? 3 * spacing : spacing) && std::abs(height) <= kOffPoint &&
          normals.row(v).dot(cloud.normals.row(p)) > kSameWay) {
        result[at] = made_up ? Support::MadeUp : p < cloud.seen ? Support::Kept : Support::Carried;
        all.between[at] = !made_up && beside > kBeyondRim * spacing ? 1 : 0;
        continue;
      }
    }
    if (place.face >= 0) {
      Index corner = 0;
      place.barycentric.maxCoeff(&corner);
      const bool bare = cover.share[body_faces(place.face, corner)] < 0.5;
      const bool deep = winding[at] > 0.5 && place.squared_distance > kDeep * kDeep;
      if (bare || deep) {
        result[at] = Support::Cut;
      }
    }
  }
  for (const std::vector<int>& rim : boundary_loops(topology)) {
    for (const int v : rim) {
      if (result[static_cast<std::size_t>(v)] == Support::None) {
        result[static_cast<std::size_t>(v)] = Support::Cut;
      }
    }
  }
  return all;
}

/// Support reaches so far that points have no gaps between them, and so far beyond the last of them
/// too: there what is cut off begins at these.
void cut_back(std::vector<Support>& support, const std::vector<char>& between,
              const Adjacency& neighbors) {
  std::vector<int> front;
  for (std::size_t v = 0; v < support.size(); ++v) {
    if (support[v] == Support::Cut) {
      front.push_back(static_cast<int>(v));
    }
  }
  while (!front.empty()) {
    const int from = front.back();
    front.pop_back();
    for (const int v : neighbors[from]) {
      const auto at = static_cast<std::size_t>(v);
      if (between[at] != 0 && support[at] == Support::Kept) {
        support[at] = Support::Cut;
        front.push_back(v);
      }
    }
  }
}

/// Patches without support are kept or cut as a whole.
void decide_patches(std::vector<Support>& support, const Adjacency& neighbors,
                    const Eigen::VectorXd& areas, TrimmedSurface& trimmed) {
  std::vector<char> visited(support.size(), 0);
  for (std::size_t seed = 0; seed < support.size(); ++seed) {
    if (support[seed] != Support::None || visited[seed] != 0) {
      continue;
    }
    std::vector<int> patch = {static_cast<int>(seed)};
    visited[seed] = 1;
    double kept = 0;
    double cut = 0;
    double area = 0;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      area += areas[patch[i]];
      for (const int other : neighbors[patch[i]]) {
        const auto at = static_cast<std::size_t>(other);
        if (support[at] == Support::None) {
          if (visited[at] == 0) {
            visited[at] = 1;
            patch.push_back(other);
          }
        } else {
          (support[at] == Support::Cut ? cut : kept) += 1;
        }
      }
    }
    const bool hole = cut < kOpenShare * (kept + cut);
    for (const int v : patch) {
      support[static_cast<std::size_t>(v)] = hole ? Support::Kept : Support::Cut;
    }
    if (hole && area > kCountedArea) {
      ++trimmed.holes_closed;
      trimmed.area_closed += area;
    }
  }
}

/// Whether cloth lies below: the body nearest to each place is covered, and the surface lies on it
/// there, not across a limb, as a lid does.
std::vector<char> over_cloth(const Mesh& surface, const std::vector<int>& places,
                             const Points& body, const Triangles& body_faces,
                             const GarmentCover& cover) {
  const Points normals = vertex_normals(surface.vertices, surface.faces);
  const Points flesh_normals = face_normals(body, body_faces);
  Points points(static_cast<Index>(places.size()), 3);
  for (std::size_t i = 0; i < places.size(); ++i) {
    points.row(static_cast<Index>(i)) = surface.vertices.row(places[i]);
  }
  std::vector<char> over(places.size(), 0);
  const std::vector<ClosestPoint> flesh = closest_points(build_tree(body, body_faces), points);
  for (std::size_t i = 0; i < places.size(); ++i) {
    Index corner = 0;
    flesh[i].barycentric.maxCoeff(&corner);
    over[i] = cover.share[body_faces(flesh[i].face, corner)] >= 0.5 &&
                      normals.row(places[i]).dot(flesh_normals.row(flesh[i].face)) > kSameWay
                  ? 1
                  : 0;
  }
  return over;
}

/// Of the places that may go either way those that are kept, so that the rim is as short as can be:
/// a minimum cut of the rim's length and, of what is kept, the area times `costs` (1/m).
std::vector<char> kept_by_rim(const Mesh& surface, const Topology& topology,
                              const std::vector<Support>& support, const std::vector<int>& places,
                              const std::vector<double>& costs, const Eigen::VectorXd& areas) {
  std::vector<int> node(support.size(), -1);
  std::vector<double> as_kept(places.size());
  std::vector<double> as_cut(places.size(), 0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    node[static_cast<std::size_t>(places[i])] = static_cast<int>(i);
    as_kept[i] = costs[i] * areas[places[i]];
  }
  std::vector<CutLink> links;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const int a = topology.edges(e, 0);
    const int b = topology.edges(e, 1);
    const int i = node[static_cast<std::size_t>(a)];
    const int j = node[static_cast<std::size_t>(b)];
    if (i < 0 && j < 0) {
      continue;
    }
    // A rim between two vertices runs from the middle of one triangle over the edge to the other's.
    const Eigen::RowVector3d middle = 0.5 * (surface.vertices.row(a) + surface.vertices.row(b));
    double length = 0;
    for (const int corner : corners_of_edge(topology, e)) {
      Eigen::RowVector3d center = Eigen::RowVector3d::Zero();
      for (int k = 0; k < 3; ++k) {
        center += surface.vertices.row(surface.faces(corner / 3, k)) / 3;
      }
      length += (center - middle).norm();
    }
    if (i >= 0 && j >= 0) {
      links.push_back({static_cast<std::size_t>(i), static_cast<std::size_t>(j), length});
    } else {
      const bool kept = support[static_cast<std::size_t>(i < 0 ? a : b)] == Support::Kept;
      (kept ? as_cut : as_kept)[static_cast<std::size_t>(std::max(i, j))] += length;
    }
  }
  return minimum_cut(as_kept, as_cut, links);
}

/// Vertices with `value`, by pieces that hang together.
std::vector<std::vector<int>> pieces_of(const std::vector<Support>& support, Support value,
                                        const std::vector<int>& among, const Adjacency& neighbors) {
  std::vector<char> waiting(support.size(), 0);
  for (const int v : among) {
    const auto at = static_cast<std::size_t>(v);
    waiting[at] = support[at] == value ? 1 : 0;
  }
  std::vector<std::vector<int>> pieces;
  for (const int seed : among) {
    if (waiting[static_cast<std::size_t>(seed)] == 0) {
      continue;
    }
    std::vector<int> piece = {seed};
    waiting[static_cast<std::size_t>(seed)] = 0;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      for (const int other : neighbors[piece[i]]) {
        if (waiting[static_cast<std::size_t>(other)] != 0) {
          waiting[static_cast<std::size_t>(other)] = 0;
          piece.push_back(other);
        }
      }
    }
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

double area_of(const std::vector<int>& piece, const Eigen::VectorXd& areas) {
  return std::accumulate(piece.begin(), piece.end(), 0.0,
                         [&](double sum, int v) { return sum + areas[v]; });
}

/// Small pieces are no support of their own: they stay where a gap closes round them.
void leave_small_pieces(std::vector<Support>& support, const std::vector<int>& all,
                        const Adjacency& neighbors, const Eigen::VectorXd& areas) {
  const std::vector<std::vector<int>> pieces = pieces_of(support, Support::Kept, all, neighbors);
  double largest = 0;
  for (const std::vector<int>& piece : pieces) {
    largest = std::max(largest, area_of(piece, areas));
  }
  for (const std::vector<int>& piece : pieces) {
    if (area_of(piece, areas) < kPiece * largest) {
      for (const int v : piece) {
        support[static_cast<std::size_t>(v)] = Support::Cut;
      }
    }
  }
}

/// Keeps of the places that were cut, though nothing there says so, what the shortest rim keeps
/// and is a gap: it goes in from the rim, and is no roughness along it. `own` is what places say.
void close_gaps(std::vector<Support>& support, const std::vector<Support>& own, const Mesh& surface,
                const Topology& topology, const Adjacency& neighbors, const Eigen::VectorXd& areas,
                const Points& body, const Triangles& body_faces, const GarmentCover& cover,
                TrimmedSurface& trimmed) {
  std::vector<int> all(support.size());
  std::iota(all.begin(), all.end(), 0);
  leave_small_pieces(support, all, neighbors, areas);
  std::vector<int> places;
  for (const int v : all) {
    const auto at = static_cast<std::size_t>(v);
    if (support[at] == Support::Cut && own[at] != Support::Cut) {
      places.push_back(v);
    }
  }
  const std::vector<char> over = over_cloth(surface, places, body, body_faces, cover);
  std::vector<double> costs(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    // Points end there: what the other frames say does not make them go on.
    const Support said = own[static_cast<std::size_t>(places[i])];
    const bool seen = said == Support::Kept || said == Support::Carried;
    costs[i] = 2 / (over[i] != 0 && !seen ? kWidestOnCloth : kWidestOnBare);
  }
  const std::vector<char> kept = kept_by_rim(surface, topology, support, places, costs, areas);
  std::vector<Support> closed = support;
  for (std::size_t i = 0; i < places.size(); ++i) {
    closed[static_cast<std::size_t>(places[i])] = kept[i] != 0 ? Support::Kept : Support::Cut;
  }
  const EdgeGraph graph(topology);
  const std::vector<double> lengths = edge_lengths(topology, surface.vertices);
  std::vector<int> sources;
  std::copy_if(all.begin(), all.end(), std::back_inserter(sources),
               [&](int v) { return closed[static_cast<std::size_t>(v)] == Support::Cut; });
  const EdgePaths inwards = graph.paths_from(sources, lengths);
  sources.clear();
  std::copy_if(places.begin(), places.end(), std::back_inserter(sources),
               [&](int v) { return inwards.distances[static_cast<std::size_t>(v)] > kGoesIn; });
  const EdgePaths back = graph.paths_from(sources, lengths);
  for (const int v : places) {
    const auto at = static_cast<std::size_t>(v);
    if (closed[at] == Support::Kept && back.distances[at] > kGoesIn) {
      closed[at] = Support::Cut;
    }
  }
  for (const std::vector<int>& gap : pieces_of(closed, Support::Kept, places, neighbors)) {
    ++trimmed.holes_closed;
    for (const int v : gap) {
      const auto at = static_cast<std::size_t>(v);
      support[at] = Support::Kept;
      trimmed.area_closed += own[at] == Support::None ? areas[v] : 0;
    }
  }
}

/// 1 kept, -1 cut, smooth between.
Eigen::VectorXd smooth_sides(const std::vector<Support>& support, const Adjacency& neighbors) {
  Eigen::VectorXd side(static_cast<Index>(support.size()));
  for (Index v = 0; v < side.size(); ++v) {
    side[v] = support[static_cast<std::size_t>(v)] == Support::Cut ? -1 : 1;
  }
  for (int round = 0; round < kSmoothRounds; ++round) {
    Eigen::VectorXd next = side;
    for (Index v = 0; v < side.size(); ++v) {
      double sum = 0;
      for (const int other : neighbors[v]) {
        sum += side[other];
      }
      const auto count = static_cast<double>(neighbors[v].size());
      next[v] = count > 0 ? 0.5 * side[v] + 0.5 * sum / count : side[v];
    }
    side = next;
  }
  // No vertex lies on the line, where triangles would lose their area.
  return side.unaryExpr([](double s) { return std::abs(s) < 1e-3 ? 1e-3 : s; });
}

/// The part of the surface where `side` is positive.
Mesh clipped(const Mesh& surface, const Eigen::VectorXd& side) {
  std::vector<Eigen::RowVector3d> vertices;
  std::vector<int> kept(static_cast<std::size_t>(side.size()), -1);
  std::map<std::pair<int, int>, int> on_edge;
  std::vector<std::array<int, 3>> faces;
  const auto whole = [&](int v) {
    int& index = kept[static_cast<std::size_t>(v)];
    if (index < 0) {
      index = static_cast<int>(vertices.size());
      vertices.emplace_back(surface.vertices.row(v));
    }
    return index;
  };
  const auto between = [&](int a, int b) {
    const std::pair<int, int> edge = std::minmax(a, b);
    const auto [found, fresh] = on_edge.try_emplace(edge, static_cast<int>(vertices.size()));
    if (fresh) {
      const double t = side[edge.first] / (side[edge.first] - side[edge.second]);
      vertices.emplace_back((1 - t) * surface.vertices.row(edge.first) +
                            t * surface.vertices.row(edge.second));
    }
    return found->second;
  };
  for (Index f = 0; f < surface.faces.rows(); ++f) {
    std::vector<int> polygon;
    for (int k = 0; k < 3; ++k) {
      const int a = surface.faces(f, k);
      const int b = surface.faces(f, (k + 1) % 3);
      if (side[a] > 0) {
        polygon.push_back(whole(a));
      }
      if ((side[a] > 0) != (side[b] > 0)) {
        polygon.push_back(between(a, b));
      }
    }
    for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
      faces.push_back({polygon[0], polygon[k], polygon[k + 1]});
    }
  }
  Mesh mesh;
  mesh.vertices.resize(static_cast<Index>(vertices.size()), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    mesh.vertices.row(static_cast<Index>(v)) = vertices[v];
  }
  mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    mesh.faces.row(static_cast<Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  }
  return mesh;
}

}  // namespace

Mesh without_small_pieces(const Mesh& mesh, double share) {
  const Components pieces = connected_components(topology_of(mesh.faces, mesh.vertices.rows()));
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(std::max(1, pieces.count));
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    sums[pieces.of_face[static_cast<std::size_t>(f)]] += areas[f];
  }
  std::vector<Index> kept;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    if (sums[pieces.of_face[static_cast<std::size_t>(f)]] >= share * sums.maxCoeff()) {
      kept.push_back(f);
    }
  }
  return part_of_mesh(mesh, kept);
}

TrimmedSurface trim_surface(const Mesh& surface, const GarmentPoints& points, double spacing,
                            const Points& body, const Triangles& body_faces,
                            const GarmentCover& cover) {
  TrimmedSurface trimmed;
  if (surface.faces.rows() == 0) {
    return trimmed;
  }
  const Topology topology = topology_of(surface.faces, surface.vertices.rows());
  const Adjacency neighbors = vertex_neighbors(topology);
  const Eigen::VectorXd areas = vertex_areas(surface.vertices, surface.faces);
  Supports found = supports(surface, points, spacing, body, body_faces, cover, topology);
  std::vector<Support>& support = found.of;
  const std::vector<Support> own = support;
  for (Index v = 0; v < areas.size(); ++v) {
    Support& place = support[static_cast<std::size_t>(v)];
    if (place == Support::MadeUp) {
      trimmed.area_made_up += areas[v];
      place = Support::Kept;
    } else if (place == Support::Carried) {
      trimmed.area_carried += areas[v];
      place = Support::Kept;
    }
  }
  decide_patches(support, neighbors, areas, trimmed);
  cut_back(support, found.between, neighbors);
  close_gaps(support, own, surface, topology, neighbors, areas, body, body_faces, cover, trimmed);
  trimmed.mesh = without_small_pieces(clipped(surface, smooth_sides(support, neighbors)), kPiece);
  return trimmed;
}

}  // namespace atelier
