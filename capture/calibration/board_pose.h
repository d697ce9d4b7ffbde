#pragma once

#include <vector>

#include "capture/calibration/find_board.h"
#include "capture/calibration/lens.h"

namespace atelier {

/// A pose that a view of a planar board can have.
struct BoardPose {
  RigidNumbers camera_from_board = RigidNumbers::Zero();
  double rms = 0;  ///< px
};

/// The poses of a planar board in one view, best first: one, or the two between which a small or
/// distant board leaves the choice open (Collins and Bartoli 2014, OpenCV's IPPE, refined). None if
/// the corners cannot be those of a board.
std::vector<BoardPose> board_poses(const Camera& camera, const BoardView& view,
                                   const BoardPoints& points);

/// Pixel error, rms, of a view under a pose; infinite where a corner lies behind the camera.
double pose_rms(const Camera& camera, const BoardView& view, const BoardPoints& points,
                const RigidNumbers& camera_from_board);

}  // namespace atelier
