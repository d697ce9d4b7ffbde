#include "bodymodel/underlying/body_error.h"

#include <cmath>
#include <optional>

#include "bodymodel/underlying/clothed_scan.h"
#include "core/normals.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr double kReach = 0.05;     // m
constexpr double kOutside = 0.001;  // m
constexpr double kClose = 0.01;     // m
constexpr double kSkirt = 0.6;      // m

/// Signed distance from a garment, positive inside.
std::optional<double> gap_under(const ScanSurface& garment, const Eigen::Vector3d& x,
                                const Eigen::Vector3d& normal) {
  const auto over = cover_gap(garment, x, normal, kReach, CoverSign::Normal);
  return over ? std::optional(over->gap) : std::nullopt;
}

bool looks_at(const ScanSurface& garment, const Eigen::Vector3d& x, const Eigen::Vector3d& normal) {
  if (normal.squaredNorm() < 0.5) {
    return false;
  }
  const RayHit hit = first_hit(garment.cover.tree, {x, normal, 0, kSkirt});
  if (hit.face < 0) {
    return false;
  }
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    outward +=
        hit.barycentric[k] * garment.normals.row(garment.cover.faces(hit.face, k)).transpose();
  }
  return outward.dot(normal) > 0;
}

/// The terms of one vertex.
struct VertexError {
  double distance = 0;
  bool covered = false;
  std::optional<double> gap, true_gap;
};

}  // namespace

BodyError body_error(const Triangles& faces, const Points& vertices, const Mesh& true_body,
                     const std::vector<Mesh>& garments) {
  std::vector<ScanSurface> surfaces;
  for (const Mesh& garment : garments) {
    if (garment.vertices.rows() > 0) {
      Mesh plain;
      plain.vertices = garment.vertices;
      plain.faces = garment.faces;
      surfaces.push_back(scan_surface({plain, {}}));
    }
  }
  const TriangleTree tree = build_tree(true_body.vertices, true_body.faces);
  const Points true_normals = vertex_normals(true_body.vertices, true_body.faces);
  const Eigen::VectorXd areas = vertex_areas(vertices, faces);
  std::vector<VertexError> errors(static_cast<std::size_t>(vertices.rows()));
  parallel_for(vertices.rows(), 256, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      VertexError& error = errors[static_cast<std::size_t>(v)];
      const Eigen::Vector3d x = vertices.row(v).transpose();
      const ClosestPoint closest = closest_point(tree, x);
      error.distance = std::sqrt(closest.squared_distance);
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k) {
        normal +=
            closest.barycentric[k] * true_normals.row(true_body.faces(closest.face, k)).transpose();
      }
      normal.normalize();
      for (const ScanSurface& garment : surfaces) {
        const auto true_gap = gap_under(garment, closest.point, normal);
        const bool under =
            (true_gap && *true_gap >= 0) || (!true_gap && looks_at(garment, closest.point, normal));
        error.covered = error.covered || under;
        if (!under) {
          continue;
        }
        const auto gap = gap_under(garment, x, normal);
        if (gap && (!error.gap || *gap < *error.gap)) {
          error.gap = gap;
          error.true_gap = true_gap;
        }
      }
    }
  });
  BodyError sum;
  const bool same =
      equal_arrays(faces, true_body.faces) && vertices.rows() == true_body.vertices.rows();
  double area = 0;
  double covered_area = 0;
  Index outside = 0;
  double apart = 0;
  double covered_apart = 0;
  for (std::size_t v = 0; v < errors.size(); ++v) {
    const VertexError& error = errors[v];
    const double weight = areas[static_cast<Index>(v)];
    const double moved =
        same ? (vertices.row(static_cast<Index>(v)) - true_body.vertices.row(static_cast<Index>(v)))
                   .norm()
             : 0;
    area += weight;
    sum.mean += weight * error.distance;
    apart += weight * moved;
    if (!error.covered) {
      continue;
    }
    ++sum.covered;
    covered_area += weight;
    sum.covered_mean += weight * error.distance;
    covered_apart += weight * moved;
    if (error.gap && *error.gap < -kOutside) {
      ++outside;
      sum.outside_depth -= *error.gap;
    }
    if (error.gap && error.true_gap && *error.true_gap >= 0 && *error.true_gap < kClose) {
      ++sum.close;
      sum.proximity += std::abs(*error.gap - *error.true_gap);
      sum.proximity_bias += *error.gap - *error.true_gap;
    }
  }
  const auto over = [](double value, double by) { return by > 0 ? value / by : 0; };
  sum.mean = over(sum.mean, area);
  sum.covered_mean = over(sum.covered_mean, covered_area);
  if (same) {
    sum.vertex_mean = over(apart, area);
    sum.vertex_covered_mean = over(covered_apart, covered_area);
  }
  sum.outside_rate = over(static_cast<double>(outside), static_cast<double>(sum.covered));
  sum.outside_depth = over(sum.outside_depth, static_cast<double>(outside));
  sum.proximity = over(sum.proximity, static_cast<double>(sum.close));
  sum.proximity_bias = over(sum.proximity_bias, static_cast<double>(sum.close));
  return sum;
}

}  // namespace atelier
