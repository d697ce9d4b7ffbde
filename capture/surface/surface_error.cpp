#include "capture/surface/surface_error.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/saturating_cast.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr double kWidestCosine = 0.3420201433;  // of 70 degrees
constexpr double kNear = 0.005;                 // m
constexpr double kFloating = 0.02;              // m

/// Points spread over a mesh by area: every triangle gets its share, rounded by chance.
struct Spread {
  Points points, normals;
  std::vector<int> faces;
  double area = 0;
};

Spread spread_over(const Mesh& mesh, double spacing) {
  Random random{1, 0, 0};
  Spread spread;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.row(mesh.faces(f, 0)).transpose();
    const Eigen::Vector3d b = mesh.vertices.row(mesh.faces(f, 1)).transpose();
    const Eigen::Vector3d c = mesh.vertices.row(mesh.faces(f, 2)).transpose();
    const Eigen::Vector3d across = (b - a).cross(c - a);
    const double area = 0.5 * across.norm();
    spread.area += area;
    const auto count = saturating_cast<int>(area / (spacing * spacing) + uniform(random));
    for (int i = 0; i < count; ++i) {
      double u = uniform(random);
      double v = uniform(random);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      points.emplace_back(a + u * (b - a) + v * (c - a));
      normals.emplace_back(across.normalized());
      spread.faces.push_back(static_cast<int>(f));
    }
  }
  spread.points.resize(static_cast<Index>(points.size()), 3);
  spread.normals.resize(static_cast<Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    spread.points.row(static_cast<Index>(i)) = points[i].transpose();
    spread.normals.row(static_cast<Index>(i)) = normals[i].transpose();
  }
  return spread;
}

bool is_seen(const TriangleTree& tree, const Camera& camera, const Eigen::Vector3d& point,
             const Eigen::Vector3d& normal) {
  const Eigen::Vector3d to_camera = camera_center(camera) - point;
  if (normal.dot(to_camera.normalized()) < kWidestCosine) {
    return false;
  }
  const auto pixel = project(camera, point);
  if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= camera.width ||
      pixel->y() >= camera.height) {
    return false;
  }
  constexpr double kOffSurface = 1e-4;  // m
  return !any_hit(tree, {point + kOffSurface * normal, to_camera, 0, 1});
}

double mean_iou(const std::vector<std::uint8_t>& truth, const std::vector<std::uint8_t>& found) {
  std::array<int, 256> both{};
  std::array<int, 256> either{};
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i] == found[i]) {
      ++both[truth[i]];
      ++either[truth[i]];
    } else {
      ++either[truth[i]];
      ++either[found[i]];
    }
  }
  std::array<bool, 256> is_true{};
  for (const std::uint8_t label : truth) {
    is_true[label] = true;
  }
  double sum = 0;
  int count = 0;
  for (std::size_t id = 0; id < 256; ++id) {
    if (is_true[id]) {
      sum += static_cast<double>(both[id]) / either[id];
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

SurfaceSamples seen_surface(const Mesh& truth, const std::vector<Camera>& cameras, double spacing) {
  check_mesh(truth);
  const Spread spread = spread_over(truth, spacing);
  const TriangleTree tree = build_tree(truth.vertices, truth.faces);
  std::vector<char> seen(static_cast<std::size_t>(spread.points.rows()), 0);
  parallel_for(spread.points.rows(), 256, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      int views = 0;
      for (std::size_t k = 0; k < cameras.size() && views < 2; ++k) {
        views += is_seen(tree, cameras[k], spread.points.row(i).transpose(),
                         spread.normals.row(i).transpose())
                     ? 1
                     : 0;
      }
      seen[static_cast<std::size_t>(i)] = views == 2 ? 1 : 0;
    }
  });
  std::vector<int> rows;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] != 0) {
      rows.push_back(static_cast<int>(i));
    }
  }
  SurfaceSamples samples;
  samples.points = spread.points(rows, Eigen::all);
  samples.normals = spread.normals(rows, Eigen::all);
  for (const int row : rows) {
    if (!truth.labels.empty()) {
      const int corner = truth.faces(spread.faces[static_cast<std::size_t>(row)], 0);
      samples.labels.push_back(truth.labels[static_cast<std::size_t>(corner)]);
    }
  }
  samples.area = spread.area;
  samples.seen_area = spread.points.rows() > 0 ? spread.area * static_cast<double>(rows.size()) /
                                                     static_cast<double>(spread.points.rows())
                                               : 0;
  return samples;
}

SurfaceError surface_error(const Mesh& scan, const Mesh& truth, const SurfaceSamples& seen) {
  check_mesh(scan);
  ATELIER_CHECK(seen.points.rows() > 0, "no part of the ground truth is seen");
  if (scan.faces.rows() == 0) {
    throw DataError("", "scan", "no faces", "a surface");
  }
  SurfaceError error;
  const TriangleTree truth_tree = build_tree(truth.vertices, truth.faces);
  const Spread spread = spread_over(scan, 0.005);
  double floating = 0;
  for (const ClosestPoint& nearest : closest_points(truth_tree, spread.points)) {
    const double distance = std::sqrt(nearest.squared_distance);
    error.accuracy += distance;
    floating += distance > kFloating ? 1 : 0;
  }
  const auto scanned = static_cast<double>(std::max<Index>(spread.points.rows(), 1));
  error.accuracy /= scanned;
  error.floating = floating / scanned;
  const TriangleTree scan_tree = build_tree(scan.vertices, scan.faces);
  std::vector<std::uint8_t> found;
  std::map<std::uint8_t, double> of_label;
  std::size_t sample = 0;
  for (const ClosestPoint& nearest : closest_points(scan_tree, seen.points)) {
    const double distance = std::sqrt(nearest.squared_distance);
    error.from_truth += distance;
    error.completeness += distance <= kNear ? 1 : 0;
    if (!seen.labels.empty()) {
      const std::uint8_t label = seen.labels[sample++];
      error.completeness_of[label] += distance <= kNear ? 1 : 0;
      of_label[label] += 1;
    }
    if (!scan.labels.empty()) {
      Index corner = 0;
      nearest.barycentric.maxCoeff(&corner);
      found.push_back(scan.labels[static_cast<std::size_t>(scan.faces(nearest.face, corner))]);
    }
  }
  const auto samples = static_cast<double>(seen.points.rows());
  error.from_truth /= samples;
  error.completeness /= samples;
  for (auto& [label, share] : error.completeness_of) {
    share /= of_label[label];
  }
  error.chamfer = 0.5 * (error.accuracy + error.from_truth);
  if (!found.empty() && !seen.labels.empty()) {
    error.label_iou = mean_iou(seen.labels, found);
  }
  return error;
}

}  // namespace atelier
