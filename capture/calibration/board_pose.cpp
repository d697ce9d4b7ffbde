#include "capture/calibration/board_pose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

namespace atelier {
namespace {

Eigen::Vector3d corner(const BoardPoints& points, int id) {
  return {points(id, 0), points(id, 1), 0};
}

/// A few steps of Gauss and Newton on the six numbers, halved while they do not help.
BoardPose refined(const Camera& camera, const BoardView& view, const BoardPoints& points,
                  const RigidNumbers& start) {
  const LensNumbers lens = lens_of(camera);
  BoardPose pose{start, pose_rms(camera, view, points, start)};
  for (int iteration = 0; iteration < 10 && std::isfinite(pose.rms); ++iteration) {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    for (std::size_t i = 0; i < view.ids.size(); ++i) {
      const Eigen::Vector3d x = corner(points, view.ids[i]);
      const Eigen::Vector3d in_camera = moved(pose.camera_from_board, x);
      const auto pixel = lens_pixel(camera.distortion_model, lens, in_camera);
      const Eigen::Matrix<double, 2, 6> j =
          lens_jacobian(camera.distortion_model, lens, in_camera).by_point *
          moved_jacobian(pose.camera_from_board, x);
      const Eigen::Vector2d error =
          *pixel - view.pixels.row(static_cast<Eigen::Index>(i)).transpose();
      normal += j.transpose() * j;
      right += j.transpose() * error;
    }
    RigidNumbers step = normal.ldlt().solve(right);
    bool better = false;
    for (int halving = 0; halving < 6 && step.allFinite(); ++halving, step *= 0.5) {
      const RigidNumbers next = pose.camera_from_board - step;
      const double rms = pose_rms(camera, view, points, next);
      if (rms < pose.rms) {
        better = rms < pose.rms * (1 - 1e-6);
        pose = {next, rms};
        break;
      }
    }
    if (!better) {
      break;
    }
  }
  return pose;
}

}  // namespace

double pose_rms(const Camera& camera, const BoardView& view, const BoardPoints& points,
                const RigidNumbers& camera_from_board) {
  const LensNumbers lens = lens_of(camera);
  double sum = 0;
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    const auto pixel = lens_pixel(camera.distortion_model, lens,
                                  moved(camera_from_board, corner(points, view.ids[i])));
    if (!pixel) {
      return std::numeric_limits<double>::infinity();
    }
    sum += (*pixel - view.pixels.row(static_cast<Eigen::Index>(i)).transpose()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(view.ids.size()));
}

std::vector<BoardPose> board_poses(const Camera& camera, const BoardView& view,
                                   const BoardPoints& points) {
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> flat;  // on the plane z = 1
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    Camera at_origin = camera;
    at_origin.camera_from_world_rotation.setIdentity();
    const auto ray = ray_direction(at_origin, view.pixels.row(row));
    if (!ray) {
      continue;
    }
    object.emplace_back(points(view.ids[i], 0), points(view.ids[i], 1), 0);
    flat.emplace_back(ray->x() / ray->z(), ray->y() / ray->z());
  }
  if (object.size() < 4) {
    return {};
  }
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  try {
    cv::solvePnPGeneric(object, flat, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotations,
                        translations, false, cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return {};  // corners that lie on a line
  }
  std::vector<BoardPose> poses;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    RigidNumbers start;
    for (int k = 0; k < 3; ++k) {
      start[k] = rotations[i].at<double>(k);
      start[3 + k] = translations[i].at<double>(k);
    }
    if (!start.allFinite()) {
      continue;
    }
    const BoardPose pose = refined(camera, view, points, start);
    if (std::isfinite(pose.rms)) {
      poses.push_back(pose);
    }
  }
  std::sort(poses.begin(), poses.end(),
            [](const BoardPose& a, const BoardPose& b) { return a.rms < b.rms; });
  // The second choice counts only where the first is not much better, and is another one.
  constexpr double kOpen = 4;
  constexpr double kNoise = 0.5;  // px that no detector is below
  if (poses.size() > 1 &&
      (poses[1].rms > kOpen * (poses[0].rms + kNoise) ||
       (poses[0].camera_from_board - poses[1].camera_from_board).head<3>().norm() < 1e-3)) {
    poses.pop_back();
  }
  return poses;
}

}  // namespace atelier
