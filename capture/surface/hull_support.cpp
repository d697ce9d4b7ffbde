#include "capture/surface/hull_support.h"

#include <array>

#include "core/error.h"
#include "core/tree.h"

namespace atelier {
namespace {

bool occupied(const VisualHull& hull, int x, int y, int z) {
  return x >= 0 && y >= 0 && z >= 0 && x < hull.nx && y < hull.ny && z < hull.nz &&
         hull.at(x, y, z);
}

/// Away from the cells around: zero for a cell all of whose neighbours are like it.
Eigen::Vector3d outward(const VisualHull& hull, int x, int y, int z) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (!occupied(hull, x + dx, y + dy, z + dz)) {
          normal += Eigen::Vector3d(dx, dy, dz);
        }
      }
    }
  }
  return normal;
}

/// Whether a map looks through the place at a surface behind it.
bool seen_through(const Eigen::Vector3d& place, const std::vector<DepthMap>& maps, double slack,
                  double min_confidence) {
  for (const DepthMap& map : maps) {
    const auto pixel = project(map.camera, place);
    if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= map.camera.width ||
        pixel->y() >= map.camera.height) {
      continue;
    }
    const auto x = static_cast<int>(pixel->x());
    const auto y = static_cast<int>(pixel->y());
    if (map.confidence.at(x, y) >= min_confidence &&
        map.depth.at(x, y) > camera_from_world(map.camera, place).z() + slack) {
      return true;
    }
  }
  return false;
}

}  // namespace

Mesh hull_support(const VisualHull& hull, const std::vector<DepthMap>& maps, const Mesh& points,
                  double distance, double min_confidence) {
  ATELIER_CHECK(points.vertices.rows() > 0, "points that stereo is sure of");
  std::vector<Eigen::Vector3d> places;
  std::vector<Eigen::Vector3d> normals;
  for (int z = 0; z < hull.nz; ++z) {
    for (int y = 0; y < hull.ny; ++y) {
      for (int x = 0; x < hull.nx; ++x) {
        const Eigen::Vector3d normal =
            occupied(hull, x, y, z) ? outward(hull, x, y, z) : Eigen::Vector3d::Zero();
        if (normal.squaredNorm() == 0) {
          continue;
        }
        const Eigen::Vector3d place =
            hull.origin + hull.voxel_size * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        if (!seen_through(place, maps, hull.voxel_size, min_confidence)) {
          places.push_back(place);
          normals.push_back(normal.normalized());
        }
      }
    }
  }
  Points asked(static_cast<Index>(places.size()), 3);
  for (Index i = 0; i < asked.rows(); ++i) {
    asked.row(i) = places[static_cast<std::size_t>(i)].transpose();
  }
  const std::vector<ClosestPoint> nearest =
      closest_points(build_point_tree(points.vertices), asked);
  std::vector<Index> kept;
  for (Index i = 0; i < asked.rows(); ++i) {
    if (nearest[static_cast<std::size_t>(i)].squared_distance > distance * distance) {
      kept.push_back(i);
    }
  }
  const auto n = static_cast<Index>(kept.size());
  Mesh support;
  support.vertices.resize(n, 3);
  support.normals.resize(n, 3);
  support.colors.resize(points.colors.rows() > 0 ? n : 0, 3);
  support.confidence = Eigen::VectorXf::Zero(n);
  for (Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(kept[static_cast<std::size_t>(i)]);
    support.vertices.row(i) = places[k].transpose();
    support.normals.row(i) = normals[k].transpose();
    if (points.colors.rows() > 0) {
      support.colors.row(i) = points.colors.row(nearest[k].face);
    }
  }
  return support;
}

}  // namespace atelier
