#include "capture/linear_triangulation.h"

#include <Eigen/Eigenvalues>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr int kRounds = 4;  // what a further one changes is far below a detection's error

/// The square of the sine of the angle between rays, about, below which they are parallel.
constexpr double kLeastParallax = 1e-10;

/// A detection as two planes through the camera's centre, in the world: by the depth, the distances
/// to them are pixels.
struct Planes {
  Eigen::Matrix<double, 2, 3> normals;
  Eigen::Vector2d offsets;
  Eigen::Vector3d forward;  ///< the camera's
  double forward_offset;
  double weight;
};

std::optional<Planes> planes_of(const Camera& camera, const Eigen::Vector3d& detection) {
  if (!(detection.z() > 0)) {
    return std::nullopt;
  }
  const Eigen::Matrix3d& rotation = camera.camera_from_world_rotation;
  const Eigen::Vector3d& translation = camera.camera_from_world_translation;
  Eigen::Vector2d place((detection.x() - camera.cx) / camera.fx,
                        (detection.y() - camera.cy) / camera.fy);
  if (camera.distortion_model != Distortion::None) {
    const auto direction = ray_direction(camera, detection.head<2>());
    if (!direction) {
      return std::nullopt;
    }
    const Eigen::Vector3d ray = rotation * *direction;
    if (!(ray.z() > 1e-9)) {
      return std::nullopt;
    }
    place = ray.head<2>() / ray.z();
  }
  Planes planes;
  const Eigen::Vector2d focal(camera.fx, camera.fy);
  planes.normals = focal.asDiagonal() * (place * rotation.row(2) - rotation.topRows<2>());
  planes.offsets = focal.cwiseProduct(place * translation.z() - translation.head<2>());
  planes.forward = rotation.row(2).transpose();
  planes.forward_offset = translation.z();
  planes.weight = detection.z() * detection.z();
  return planes;
}

Eigen::RowVector3d point_of(const std::vector<Planes>& all) {
  const Eigen::RowVector3d nothing =
      Eigen::RowVector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  if (all.size() < 2) {
    return nothing;
  }
  std::optional<Eigen::Vector3d> point;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Planes& planes : all) {
      const double depth = point ? planes.forward.dot(*point) + planes.forward_offset : 1;
      if (!(depth > 0)) {
        return nothing;
      }
      const double weight = planes.weight / (depth * depth);
      normal += weight * planes.normals.transpose() * planes.normals;
      right -= weight * planes.normals.transpose() * planes.offsets;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(normal);
    const Eigen::Vector3d& values = solver.eigenvalues();  // increasing
    if (!(values[0] > kLeastParallax * values[2])) {
      return nothing;
    }
    point =
        solver.eigenvectors() * (solver.eigenvectors().transpose() * right).cwiseQuotient(values);
  }
  return point->transpose();
}

}  // namespace

Points linear_points(const std::vector<Camera>& cameras, std::span<const Keypoints2d> detections) {
  ATELIER_CHECK(detections.size() == cameras.size(), "one set of detections for each camera");
  const Index count = detections.empty() ? 0 : detections.front().rows();
  for (const Keypoints2d& some : detections) {
    ATELIER_CHECK(some.rows() == count, "as many detections in every camera");
  }
  Points points(count, 3);
  parallel_for(count, 256, [&](Index begin, Index end) {
    std::vector<Planes> planes;
    for (Index i = begin; i < end; ++i) {
      planes.clear();
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        if (const auto own = planes_of(cameras[c], detections[c].row(i).transpose())) {
          planes.push_back(*own);
        }
      }
      points.row(i) = point_of(planes);
    }
  });
  return points;
}

}  // namespace atelier
