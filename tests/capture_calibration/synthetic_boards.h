#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "capture/calibration/calibrate.h"
#include "capture/calibration/lens.h"
#include "core/random.h"

namespace atelier::fixtures {

/// Cameras on an arc that look at the origin, 2 m away, with lenses that are not alike.
inline std::vector<Camera> arc_of_cameras(int count, double distortion = 1) {
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double azimuth = 0.5 * i;
    Camera camera;
    camera.id = "cam" + std::to_string(i);
    camera.width = 1280;
    camera.height = 960;
    camera.fx = 1000 + 40 * i;
    camera.fy = 1005 + 40 * i;
    camera.cx = 650 - 5 * i;
    camera.cy = 470 + 4 * i;
    camera.distortion_model = Distortion::Brown;
    camera.distortion = {-0.15 * distortion, 0.06 * distortion, 0.001 * distortion,
                         -0.0007 * distortion};
    const Eigen::Vector3d centre(2 * std::sin(azimuth), 0.4 + 0.2 * (i % 2), 2 * std::cos(azimuth));
    const Eigen::Vector3d z = -centre.normalized();
    const Eigen::Vector3d x = Eigen::Vector3d(0, -1, 0).cross(z).normalized();
    camera.camera_from_world_rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
    camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
    cameras.push_back(camera);
  }
  return cameras;
}

/// A board held before the cameras, tilted every way.
inline RigidNumbers held_board(const BoardOptions& board, Random& random, double azimuth,
                               double tilt = 0.6, double reach = 0.5) {
  const auto points = board_points(board);
  const Eigen::Vector3d middle(points.col(0).mean(), points.col(1).mean(), 0);
  const Eigen::Matrix3d rotation =
      (Eigen::AngleAxisd(azimuth + uniform(random, -tilt, tilt), Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(uniform(random, -tilt, tilt), Eigen::Vector3d::UnitX()) *
       Eigen::AngleAxisd(uniform(random, -0.5, 0.5), Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  const Eigen::Vector3d place(uniform(random, -reach, reach), uniform(random, -reach, reach),
                              uniform(random, -reach, reach));
  return rigid_of(rotation, place - rotation * middle);
}

/// Exact corners plus noise, of what falls whole into the picture.
inline std::vector<BoardView> views_of(const std::vector<Camera>& cameras,
                                       const BoardOptions& board,
                                       const std::vector<RigidNumbers>& world_from_board,
                                       double noise, Random& random) {
  const auto points = board_points(board);
  std::vector<BoardView> views;
  for (std::size_t f = 0; f < world_from_board.size(); ++f) {
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      BoardView view;
      view.camera_idx = static_cast<int>(c);
      view.frame_id = static_cast<int>(f);
      view.pixels.resize(points.rows(), 2);
      bool whole = true;
      for (Eigen::Index i = 0; i < points.rows(); ++i) {
        const auto pixel = project(
            cameras[c], moved(world_from_board[f], Eigen::Vector3d(points(i, 0), points(i, 1), 0)));
        const double x = normal(random);
        const double y = normal(random);
        whole = whole && pixel && pixel->x() > 0 && pixel->y() > 0 &&
                pixel->x() < cameras[c].width && pixel->y() < cameras[c].height;
        if (!whole) {
          break;
        }
        view.ids.push_back(static_cast<int>(i));
        view.pixels.row(i) << pixel->x() + noise * x, pixel->y() + noise * y;
      }
      if (whole) {
        views.push_back(view);
      }
    }
  }
  return views;
}

inline std::vector<RigCamera> unknown_rig(const std::vector<Camera>& cameras) {
  std::vector<RigCamera> rig;
  for (const Camera& camera : cameras) {
    RigCamera one;
    one.camera.id = camera.id;
    one.camera.width = camera.width;
    one.camera.height = camera.height;
    rig.push_back(one);
  }
  return rig;
}

inline std::vector<RigidNumbers> held_boards(const BoardOptions& board, int count, Random& random,
                                             double azimuth = 0.5) {
  std::vector<RigidNumbers> boards;
  for (int i = 0; i < count; ++i) {
    boards.push_back(held_board(board, random, azimuth));
  }
  return boards;
}

}  // namespace atelier::fixtures
