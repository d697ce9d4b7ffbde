#include "registration/trim_surface.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/normals.h"
#include "core/part_of_mesh.h"
#include "core/topology.h"
#include "core/tree.h"
#include "core/winding_number.h"

namespace atelier {
namespace {

enum class Support : char { None, Kept, Cut, MadeUp };

constexpr double kOffPoint = 0.015;    // m along the normal
constexpr double kBeyondRim = 0.5;     // of the spacing
constexpr double kSameWay = 0.5;       // cosine
constexpr double kNearBody = 0.04;     // m
constexpr double kDeep = 0.01;         // m inside of the body
constexpr double kOpenShare = 0.15;    // of what surrounds a patch
constexpr int kSmoothRounds = 12;      // means over neighbours of kept (1) and cut (-1)
constexpr double kPiece = 0.1;         // of the largest piece
constexpr double kCountedArea = 1e-4;  // m2

/// What each vertex's own place says.
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
      // What is made up stands on vertices of the body, as far apart as these are.
      const bool made_up = p >= cloud.seen;
      if (beside <= (made_up ? 3 * spacing : spacing) && std::abs(height) <= kOffPoint &&
          normals.row(v).dot(cloud.normals.row(p)) > kSameWay) {
        result[at] = made_up ? Support::MadeUp : Support::Kept;
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
  for (Index v = 0; v < areas.size(); ++v) {
    Support& own = support[static_cast<std::size_t>(v)];
    if (own == Support::MadeUp) {
      trimmed.area_made_up += areas[v];
      own = Support::Kept;
    }
  }
  decide_patches(support, neighbors, areas, trimmed);
  cut_back(support, found.between, neighbors);
  trimmed.mesh = without_small_pieces(clipped(surface, smooth_sides(support, neighbors)), kPiece);
  return trimmed;
}

}  // namespace atelier
