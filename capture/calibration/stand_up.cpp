#include <Eigen/Geometry>
#include <Eigen/LU>
#include <string>

#include "capture/calibration/calibrate.h"
#include "core/error.h"

namespace atelier {
namespace {

/// The point nearest to the optical axes of the rig; the mean board where they are parallel.
Eigen::Vector3d middle_of(const Calibration& calibration, const Eigen::Vector3d& mean_board) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  int count = 0;
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    if (!calibration.quality[c].in_rig) {
      continue;
    }
    const Camera& camera = calibration.cameras[c];
    const Eigen::Vector3d axis = camera.camera_from_world_rotation.row(2).transpose();
    const Eigen::Matrix3d off = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    normal += off;
    right += off * camera_center(camera);
    ++count;
  }
  if (count < 2 || normal.determinant() < 1e-2) {
    return mean_board;
  }
  return normal.inverse() * right;
}

Eigen::Matrix3d turning(const Eigen::Vector3d& up) {
  return Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitY()).toRotationMatrix();
}

}  // namespace

Calibration stand_up(Calibration calibration, const BoardOptions& board, int ground_frame) {
  const auto points = board_points(board);
  const Eigen::Vector3d board_middle(points.col(0).mean(), points.col(1).mean(), 0);
  Eigen::Vector3d mean_board = Eigen::Vector3d::Zero();
  for (const auto& [frame, pose] : calibration.world_from_board) {
    mean_board +=
        moved(pose, board_middle) / static_cast<double>(calibration.world_from_board.size());
  }
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    if (calibration.quality[c].in_rig) {
      up -= calibration.cameras[c].camera_from_world_rotation.row(1).transpose();
      centre += camera_center(calibration.cameras[c]);
      count += 1;
    }
  }
  centre /= count;
  Eigen::Vector3d origin;
  if (ground_frame >= 0) {
    const auto found = calibration.world_from_board.find(ground_frame);
    if (found == calibration.world_from_board.end()) {
      throw DataError("", "frame " + std::to_string(ground_frame), "no board of it was used",
                      "a frame in which the board lies on the ground");
    }
    up = rotation_of(found->second).col(2);
    origin = moved(found->second, board_middle);
    if (up.dot(centre - origin) < 0) {
      up = -up;
    }
  } else {
    origin = middle_of(calibration, mean_board);
  }
  if (up.norm() < 1e-3) {
    up = -calibration.cameras.front().camera_from_world_rotation.row(1).transpose();
  }
  const Eigen::Matrix3d new_from_old = turning(up.normalized());
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    if (!calibration.quality[c].in_rig) {
      continue;
    }
    Camera& camera = calibration.cameras[c];
    // x_camera = R (x_old) + t and x_old = M' x_new + origin
    camera.camera_from_world_translation += camera.camera_from_world_rotation * origin;
    camera.camera_from_world_rotation *= new_from_old.transpose();
  }
  const RigidNumbers new_world = rigid_of(new_from_old, -new_from_old * origin);
  for (auto& [frame, pose] : calibration.world_from_board) {
    pose = chained(new_world, pose);
  }
  return calibration;
}

}  // namespace atelier
