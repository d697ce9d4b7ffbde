#include "bodymodel/underlying/outer_surface.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "bodymodel/underlying/vertex_energy.h"
#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/topology.h"

namespace atelier {
namespace {

constexpr double kAlongSkin = 0.5;   // cosine between the surface and seen skin
constexpr double kAlongCover = 0.2;  // and hair or shoes, which are rounder than what is in them
constexpr double kBehind = 0.005;    // m behind a vertex where its ray to hair and shoes begins
constexpr double kCoarse = 4;        // times the coupling length in the first round

PlaneRow plane_of_vertex(Index v, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                         double weight, double scale) {
  const int at = static_cast<int>(v);
  return {{at, at, at}, {1, 0, 0}, normal, normal.dot(point), weight, scale};
}

/// The point of hair or shoes that a vertex looks at; nothing where it looks at none.
std::optional<PlaneRow> row_of_cover(Index v, const Eigen::Vector3d& at,
                                     const Eigen::Vector3d& normal, const ScanSurface& scan,
                                     double weight, double reach) {
  if (scan.cover.faces.rows() == 0 || normal.isZero()) {
    return std::nullopt;
  }
  const RayHit hit =
      first_hit(scan.cover.tree, {at - kBehind * normal, normal, 0, kBehind + reach});
  if (hit.face < 0) {
    return std::nullopt;
  }
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    outward += hit.barycentric[k] * scan.normals.row(scan.cover.faces(hit.face, k)).transpose();
  }
  if (outward.norm() == 0 || outward.normalized().dot(normal) < kAlongCover) {
    return std::nullopt;
  }
  return plane_of_vertex(v, at + (hit.t - kBehind) * normal, outward.normalized(), weight, 0);
}

/// The pull of hair or shoes on what stands out of them, as an ear that no normal leads to the hair
/// over it: the nearest of their points, if the vertex is before it.
std::optional<PlaneRow> row_of_outside(Index v, const Eigen::Vector3d& at, const ScanSurface& scan,
                                       double weight, double reach) {
  const auto cover = nearest_point(scan, scan.cover, at, reach);
  if (!cover || cover->border || cover->role != ScanRole::Cover ||
      cover->normal.dot(at - cover->point) <= 0) {
    return std::nullopt;
  }
  return plane_of_vertex(v, cover->point, cover->normal, weight, 0);
}

/// Correspondences of each vertex: skin that is near, else hair or shoes that it looks at.
std::vector<PlaneRow> rows_of_vertices(const Triangles& faces, const Points& x,
                                       const ScanSurface& scan, const Eigen::VectorXd& areas,
                                       const OuterSurfaceOptions& options) {
  const Points normals = vertex_normals(x, faces);
  std::vector<PlaneRow> rows(static_cast<std::size_t>(x.rows()));
  parallel_for(x.rows(), 256, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      const Eigen::Vector3d at = x.row(v).transpose();
      const Eigen::Vector3d normal = normals.row(v).transpose();
      const double weight = 0.5 * areas[v];
      const auto skin = nearest_point(scan, scan.skin, at, options.skin_reach);
      if (skin && !skin->border && skin->normal.dot(normal) > kAlongSkin) {
        rows[static_cast<std::size_t>(v)] =
            plane_of_vertex(v, skin->point, skin->normal, weight, options.skin_scale);
      } else if (const auto cover =
                     row_of_cover(v, at, normal, scan, weight, options.cover_reach)) {
        rows[static_cast<std::size_t>(v)] = *cover;
      } else if (const auto outside =
                     skin ? std::nullopt
                          : row_of_outside(v, at, scan, weight, options.skin_reach)) {
        rows[static_cast<std::size_t>(v)] = *outside;
      }
    }
  });
  return rows;
}

/// The reach of correspondences of a part of the scan; 0 where it has none.
double reach_of(ScanRole role, const OuterSurfaceOptions& options) {
  switch (role) {
    case ScanRole::Skin:
      return options.skin_reach;
    case ScanRole::Cover:
      return options.cover_reach;
    case ScanRole::Cloth:
    case ScanRole::Ignored:
      break;
  }
  return 0;
}

/// The pull of hair or shoes that no normal of the surface meets, as a sole's side below the foot:
/// the nearest point is drawn to them, unless it is skin by the scan.
std::optional<PlaneRow> row_of_overhang(const Triangles& faces, const ClosestPoint& closest,
                                        const Eigen::Vector3d& point, const ScanSurface& scan,
                                        double area, const OuterSurfaceOptions& options) {
  constexpr double kPull = 0.15;    // weight beside that of a plane, 0.5
  constexpr double kLeast = 0.003;  // m
  const double distance = std::sqrt(closest.squared_distance);
  if (distance < kLeast || nearest_point(scan, scan.skin, closest.point, options.skin_reach)) {
    return std::nullopt;
  }
  PlaneRow row;
  for (int k = 0; k < 3; ++k) {
    row.vertices[static_cast<std::size_t>(k)] = faces(closest.face, k);
  }
  row.barycentric = closest.barycentric;
  row.normal = (point - closest.point) / distance;
  row.offset = row.normal.dot(point);
  row.weight = kPull * area;
  return row;
}

/// Correspondences of each point of the scan with the surface.
std::vector<PlaneRow> rows_of_scan(const Triangles& faces, const Points& x,
                                   const TriangleTree& tree, const ScanSurface& scan,
                                   const OuterSurfaceOptions& options) {
  const Points normals = face_normals(x, faces);
  std::vector<PlaneRow> rows(scan.roles.size());
  parallel_for(scan.vertices.rows(), 256, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const ScanRole role = scan.roles[static_cast<std::size_t>(i)];
      const double reach = reach_of(role, options);
      if (reach <= 0) {
        continue;
      }
      const Eigen::Vector3d point = scan.vertices.row(i).transpose();
      const Eigen::Vector3d normal = scan.normals.row(i).transpose();
      const ClosestPoint closest = closest_point(tree, point, reach);
      const double along = role == ScanRole::Skin ? kAlongSkin : kAlongCover;
      if (closest.face < 0) {
        continue;
      }
      if (normals.row(closest.face).transpose().dot(normal) < along) {
        if (role == ScanRole::Cover) {
          rows[static_cast<std::size_t>(i)] =
              row_of_overhang(faces, closest, point, scan, scan.areas[i], options)
                  .value_or(PlaneRow{});
        }
        continue;
      }
      PlaneRow& row = rows[static_cast<std::size_t>(i)];
      for (int k = 0; k < 3; ++k) {
        row.vertices[static_cast<std::size_t>(k)] = faces(closest.face, k);
      }
      row.barycentric = closest.barycentric;
      row.normal = normal;
      row.offset = normal.dot(point);
      row.weight = 0.5 * scan.areas[i];
      row.scale = role == ScanRole::Skin ? options.skin_scale : 0;
    }
  });
  return rows;
}

/// Says how far the scan is off.
void measure_distances(OuterSurface& surface, const TriangleTree& tree, const ScanSurface& scan,
                       const OuterSurfaceOptions& options) {
  double skin = 0;
  double cover = 0;
  for (Index i = 0; i < scan.vertices.rows(); ++i) {
    const ScanRole role = scan.roles[static_cast<std::size_t>(i)];
    const double reach = reach_of(role, options);
    if (reach <= 0) {
      continue;
    }
    const bool is_skin = role == ScanRole::Skin;
    (is_skin ? surface.skin_area : surface.cover_area) += scan.areas[i];
    const ClosestPoint closest = closest_point(tree, scan.vertices.row(i).transpose(), reach);
    (is_skin ? skin : cover) +=
        scan.areas[i] * (closest.face >= 0 ? std::sqrt(closest.squared_distance) : reach);
  }
  surface.skin_distance = surface.skin_area > 0 ? skin / surface.skin_area : 0;
  surface.cover_distance = surface.cover_area > 0 ? cover / surface.cover_area : 0;
}

}  // namespace

OptionTable describe(OuterSurfaceOptions& options) {
  return OptionTable()
      .add("iterations", options.iterations, 1, 100, "",
           "Number of rounds of finding ICP correspondences and solving")
      .add("coupling_length", options.coupling_length, 0.001, 1, "m",
           "Length over which the displacement from the body changes; larger is smoother")
      .add("anchor_weight", options.anchor_weight, 1e-6, 100, "",
           "Weight of the body's own position, relative to the scan at 1")
      .add("skin_reach", options.skin_reach, 0.001, 1, "m",
           "Maximum distance of ICP correspondences of skin; raise it where tracking is inaccurate")
      .add("cover_reach", options.cover_reach, 0.001, 1, "m",
           "Maximum distance of hair and shoes from the body; raise it for long hair")
      .add("skin_scale", options.skin_scale, 0.0001, 1, "m",
           "Distance at which points of skin are treated as outliers");
}

OuterSurface outer_surface(const Triangles& faces, const Points& posed, const ScanSurface& scan,
                           const OuterSurfaceOptions& options) {
  ATELIER_CHECK(posed.allFinite(), "coordinates must be finite");
  OuterSurface surface;
  surface.vertices = posed;
  surface.support = surface.cover = Eigen::VectorXd::Zero(posed.rows());
  if (scan.vertices.rows() == 0) {
    return surface;
  }
  const Topology topology = topology_of(faces, posed.rows());
  const Eigen::VectorXd areas = vertex_areas(posed, faces);
  const Eigen::VectorXd stiffness = edge_weights(topology, posed);
  VertexEnergy energy;
  energy.edges = topology.edges;
  energy.edge_vectors.resize(energy.edges.rows(), 3);
  for (Index e = 0; e < energy.edges.rows(); ++e) {
    energy.edge_vectors.row(e) = posed.row(energy.edges(e, 0)) - posed.row(energy.edges(e, 1));
  }
  const double least = areas.size() > 0 ? 1e-3 * areas.mean() : 0;  // of vertices without a face
  energy.anchor_weights = options.anchor_weight * areas.cwiseMax(least);
  energy.anchors = posed;
  TriangleTree tree = build_tree(posed, faces);
  for (int i = 0; i < options.iterations; ++i) {
    const double left =
        options.iterations > 1 ? 1 - static_cast<double>(i) / (options.iterations - 1) : 0;
    const double length = options.coupling_length * std::pow(kCoarse, left);
    energy.edge_weights = length * length * stiffness;
    energy.rows = rows_of_vertices(faces, surface.vertices, scan, areas, options);
    const std::vector<PlaneRow> more = rows_of_scan(faces, surface.vertices, tree, scan, options);
    energy.rows.insert(energy.rows.end(), more.begin(), more.end());
    std::erase_if(energy.rows, [](const PlaneRow& row) { return row.weight <= 0; });
    surface.vertices = lower_vertex_energy(energy, surface.vertices);
    tree = refit_tree(std::move(tree), surface.vertices);
  }
  for (const PlaneRow& row : energy.rows) {
    const double weight = row_weight(row, surface.vertices);
    for (int k = 0; k < 3; ++k) {
      const int v = row.vertices[static_cast<std::size_t>(k)];
      surface.support[v] += weight * row.barycentric[k];
      surface.cover[v] += row.scale > 0 ? 0 : weight * row.barycentric[k];  // skin is robust
    }
  }
  for (Index v = 0; v < posed.rows(); ++v) {
    surface.cover[v] = surface.support[v] > 0 ? surface.cover[v] / surface.support[v] : 0;
    surface.support[v] = areas[v] > 0 ? std::min(1.0, surface.support[v] / areas[v]) : 0;
  }
  measure_distances(surface, tree, scan, options);
  const Points before = face_normals(posed, faces);
  const Points after = face_normals(surface.vertices, faces);
  for (Index f = 0; f < faces.rows(); ++f) {
    surface.turned += before.row(f).dot(after.row(f)) < 0 ? 1 : 0;
  }
  return surface;
}

std::vector<char> differently_covered(const Triangles& faces,
                                      const std::vector<const OuterSurface*>& one,
                                      const std::vector<const OuterSurface*>& other, int rings) {
  ATELIER_CHECK(!one.empty() && !other.empty(), "frames of two groups are compared");
  constexpr double kSupport = 0.1;  // of a vertex, below which a group says nothing
  const Index count = one[0]->support.size();
  const auto share = [count](const std::vector<const OuterSurface*>& group) {
    Eigen::VectorXd cover = Eigen::VectorXd::Zero(count);
    Eigen::VectorXd support = Eigen::VectorXd::Zero(count);
    for (const OuterSurface* surface : group) {
      ATELIER_CHECK(surface->support.size() == count, "surfaces of one body have the same rows");
      cover += surface->support.cwiseProduct(surface->cover);
      support += surface->support;
    }
    const double least = kSupport * static_cast<double>(group.size());
    for (Index v = 0; v < count; ++v) {
      cover[v] = support[v] > least ? cover[v] / support[v] : NAN;
    }
    return cover;
  };
  const Eigen::VectorXd first = share(one);
  const Eigen::VectorXd second = share(other);
  std::vector<char> differs(static_cast<std::size_t>(count), 0);
  for (Index v = 0; v < count; ++v) {
    differs[static_cast<std::size_t>(v)] = std::abs(first[v] - second[v]) > 0.5 ? 1 : 0;
  }
  /// Spreads over faces to vertices that may be reached; false where nothing changed.
  const auto spread = [&](const std::function<bool(Index)>& may) {
    const std::vector<char> before = differs;
    for (Index f = 0; f < faces.rows(); ++f) {
      const auto at = [&](int k) { return static_cast<std::size_t>(faces(f, k)); };
      for (int k = 0; k < 3 && (before[at(0)] | before[at(1)] | before[at(2)]) != 0; ++k) {
        if (may(faces(f, k))) {
          differs[at(k)] = 1;
        }
      }
    }
    return differs != before;
  };
  for (int ring = 0; ring < rings; ++ring) {
    spread([](Index) { return true; });
  }
  while (spread([&](Index v) { return std::isnan(first[v]) && std::isnan(second[v]); })) {
  }
  return differs;
}

Points mean_displacement(const std::vector<Points>& displacements,
                         const std::vector<Eigen::VectorXd>& supports) {
  ATELIER_CHECK(!displacements.empty() && displacements.size() == supports.size(),
                "a mean takes displacements, each with its support");
  constexpr double kUnseen = 1e-6;  // counts where no scan shows the vertex
  Points sum = Points::Zero(displacements[0].rows(), 3);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(sum.rows());
  for (std::size_t i = 0; i < displacements.size(); ++i) {
    ATELIER_CHECK(displacements[i].rows() == sum.rows() && supports[i].size() == sum.rows(),
                  "displacements of one body have the same rows");
    const Eigen::VectorXd weight = supports[i].array() + kUnseen;
    sum += weight.asDiagonal() * displacements[i];
    weights += weight;
  }
  return weights.cwiseInverse().asDiagonal() * sum;
}

}  // namespace atelier
