#include "core/depths_inside.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <vector>

#include "core/triangle_math.h"
#include "core/winding_number.h"

namespace atelier {
namespace {

/// The point of a triangle that is nearest to another one.
Eigen::Vector3d nearest_of(const std::array<Eigen::Vector3d, 3>& corners,
                           const Eigen::Vector3d& point) {
  const auto vec = [](const Eigen::Vector3d& v) { return Vec3d{v.x(), v.y(), v.z()}; };
  const Vec3d nearest =
      nearest_on_triangle(
          vec(point), Corners<double>{vec(corners[0]), vec(corners[1]), vec(corners[2]), 0, 1, 2})
          .point;
  return {nearest.x, nearest.y, nearest.z};
}

/// True if the surface overlaps itself within `room` of a point. Such a zone ends at the surface,
/// so its nearest place lies just behind one of the faces near the point: at that face's nearest
/// point, or, where only a part of the face bounds the zone, between there and a corner.
bool overlaps_near(const WindingTree& tree, const Points& vertices, const Triangles& faces,
                   const Eigen::Vector3d& point, double room) {
  constexpr double kBehind = 1e-4;  // m behind the surface; the guard itself allows as much
  constexpr int kParts = 4;         // of the way to a corner
  if (room <= 0) {
    return false;
  }
  for (const int face : faces_within(tree.tree, point, room + kBehind)) {
    std::array<Eigen::Vector3d, 3> corners;
    for (int c = 0; c < 3; ++c) {
      corners[static_cast<std::size_t>(c)] = vertices.row(faces(face, c)).transpose();
    }
    const Eigen::Vector3d normal =
        (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    const Eigen::Vector3d nearest = nearest_of(corners, point);
    for (int k = 0; k <= 3 * kParts; ++k) {
      const Eigen::Vector3d& corner = corners[static_cast<std::size_t>((k + 2) % 3)];
      const int step = (k + 2) / 3;
      const double part = static_cast<double>(step) / kParts;
      const Eigen::Vector3d place = nearest + part * (corner - nearest);
      if ((place - point).norm() <= room + kBehind &&
          winding_number(tree, place - kBehind * normal) > 1.5) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace

Eigen::VectorXd depths_inside(const Points& points, const Points& vertices, const Triangles& faces,
                              double room) {
  Eigen::VectorXd depths = Eigen::VectorXd::Zero(points.rows());
  if (points.rows() == 0) {
    return depths;
  }
  const WindingTree tree = build_winding_tree(vertices, faces);
  const std::vector<double> windings = winding_numbers(tree, points);
  for (Index i = 0; i < points.rows(); ++i) {
    const double winding = windings[static_cast<std::size_t>(i)];
    const Eigen::Vector3d point = points.row(i).transpose();
    if (winding > 0.5 && winding < 1.5 && !overlaps_near(tree, vertices, faces, point, room)) {
      depths[i] = std::sqrt(closest_point(tree.tree, point).squared_distance);
    }
  }
  return depths;
}

}  // namespace atelier
