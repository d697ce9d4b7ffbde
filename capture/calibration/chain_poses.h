#pragma once

#include <map>
#include <vector>

#include "capture/calibration/board_pose.h"

namespace atelier {

/// One view with the poses that it allows.
struct PosedView {
  BoardView view;
  std::vector<BoardPose> poses;  ///< at least one, best first
};

/// Where cameras and boards are, to start from.
struct PoseChain {
  std::vector<bool> in_rig;                      ///< of each camera
  std::vector<RigidNumbers> camera_from_world;   ///< of each camera; zero outside the rig
  std::map<int, RigidNumbers> world_from_board;  ///< of each frame that the rig saw
  std::vector<std::vector<int>> shared;          ///< [C,C] frames that two cameras agree on
  /// [C,C] frames that two cameras share and no two of which agree, where that says that they are
  /// not of one instant: three and more.
  std::vector<std::vector<int>> out_of_step;
};

/// Pairwise chaining. For two cameras each frame that both saw proposes their relative pose (up to
/// four, where small boards leave two poses each); the proposal under which most frames project
/// the other camera's corners within `tolerance` px wins. A spanning tree over the pairs with most
/// agreement, from the best connected camera of the largest group, places everything; each board
/// takes the pose under which all cameras' corners fit best (median).
///
/// @param cameras  with lenses; views of cameras without are not given
PoseChain chain_poses(const std::vector<Camera>& cameras, const std::vector<PosedView>& views,
                      const BoardPoints& points, double tolerance = 10);

}  // namespace atelier
