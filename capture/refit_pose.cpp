#include "capture/refit_pose.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>

namespace atelier {

Camera refit_pose(Camera camera, const std::vector<Sighting>& sightings) {
  constexpr std::size_t kFew = 6;
  constexpr int kSteps = 20;
  constexpr double kNear = 0.5;  // px: distances below it weigh alike
  if (sightings.size() < kFew) {
    return camera;
  }
  // Turns are about the middle of the points: then turns and shifts hardly mix.
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Sighting& sighting : sightings) {
    middle += sighting.place / static_cast<double>(sightings.size());
  }
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Vector6 right = Vector6::Zero();
    for (const Sighting& sighting : sightings) {
      const auto pixel = project(camera, sighting.place);
      const auto jacobian = project_jacobian(camera, sighting.place);
      if (!pixel || !jacobian) {
        continue;
      }
      const Eigen::Vector2d off = sighting.pixel - *pixel;
      const Eigen::Vector3d arm = sighting.place - middle;
      Eigen::Matrix<double, 3, 6> moved;  // of the place, by a small turn and a shift of the world
      moved << 0, arm.z(), -arm.y(), 1, 0, 0,  //
          -arm.z(), 0, arm.x(), 0, 1, 0,       //
          arm.y(), -arm.x(), 0, 0, 0, 1;
      const Eigen::Matrix<double, 2, 6> by = *jacobian * moved;
      const double weight = 1 / std::max(off.norm(), kNear);
      normal += weight * by.transpose() * by;
      right += weight * by.transpose() * off;
    }
    normal.diagonal() *= 1 + 1e-9;
    const Vector6 change = normal.ldlt().solve(right);
    if (!change.allFinite() || change.head<3>().norm() > 1) {
      return camera;
    }
    const double angle = change.head<3>().norm();
    const Eigen::Matrix3d turn =
        angle > 0 ? Eigen::AngleAxisd(angle, change.head<3>() / angle).toRotationMatrix()
                  : Eigen::Matrix3d::Identity();
    // world' = turn (world - middle) + middle + shift
    camera.camera_from_world_translation +=
        camera.camera_from_world_rotation * (middle + change.tail<3>() - turn * middle);
    camera.camera_from_world_rotation = camera.camera_from_world_rotation * turn;
    constexpr double kDone = 1e-9;
    if (change.norm() < kDone) {
      break;
    }
  }
  return camera;
}

}  // namespace atelier
