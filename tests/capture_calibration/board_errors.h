#pragma once

#include <cmath>
#include <map>
#include <vector>

#include "capture/calibration/board_pose.h"
#include "capture/calibration/bundle.h"

namespace atelier::fixtures {

/// How far fixed cameras are from explaining the views: the boards' poses alone are found, each
/// frame by itself, and the errors of all corners come back, px. What other calibrations are
/// compared by.
inline std::vector<double> board_errors(const std::vector<Camera>& cameras,
                                        const std::vector<BoardView>& views,
                                        const BoardOptions& board) {
  const BoardPoints points = board_points(board);
  Bundle bundle;
  bundle.points = points;
  for (const Camera& camera : cameras) {
    Bundle::Eye eye;
    eye.model = camera.distortion_model;
    eye.lens = lens_of(camera);
    eye.camera_from_world =
        rigid_of(camera.camera_from_world_rotation, camera.camera_from_world_translation);
    eye.fixed_pose = true;
    bundle.eyes.push_back(eye);
  }
  std::map<int, int> board_of_frame;
  std::map<int, double> least;
  const auto rms_of = [&](int frame, const RigidNumbers& world_from_board) {
    double sum = 0;
    for (const BoardView& view : views) {
      if (view.frame_id == frame) {
        const auto c = static_cast<std::size_t>(view.camera_idx);
        sum += std::pow(pose_rms(cameras[c], view, points,
                                 chained(bundle.eyes[c].camera_from_world, world_from_board)),
                        2);
      }
    }
    return sum;
  };
  for (const BoardView& view : views) {
    const auto c = static_cast<std::size_t>(view.camera_idx);
    for (const BoardPose& pose : board_poses(cameras[c], view, points)) {
      const RigidNumbers world_from_board =
          chained(inverse_of(bundle.eyes[c].camera_from_world), pose.camera_from_board);
      const double rms = rms_of(view.frame_id, world_from_board);
      if (!board_of_frame.contains(view.frame_id)) {
        board_of_frame[view.frame_id] = static_cast<int>(bundle.world_from_board.size());
        bundle.world_from_board.push_back(world_from_board);
        least[view.frame_id] = rms;
      } else if (rms < least[view.frame_id]) {
        bundle.world_from_board[static_cast<std::size_t>(board_of_frame[view.frame_id])] =
            world_from_board;
        least[view.frame_id] = rms;
      }
    }
  }
  for (const BoardView& view : views) {
    if (!board_of_frame.contains(view.frame_id)) {
      continue;
    }
    for (std::size_t i = 0; i < view.ids.size(); ++i) {
      bundle.sights.push_back({view.camera_idx, board_of_frame[view.frame_id], view.ids[i],
                               view.pixels.row(static_cast<Eigen::Index>(i)).transpose()});
    }
  }
  const auto errors = reprojection_errors(solve_bundle(bundle, {0, 100}).bundle);
  std::vector<double> lengths;
  for (Eigen::Index i = 0; i < errors.rows(); ++i) {
    lengths.push_back(errors.row(i).norm());
  }
  return lengths;
}

}  // namespace atelier::fixtures
