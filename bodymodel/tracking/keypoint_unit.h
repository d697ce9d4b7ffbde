#pragma once

#include <string>
#include <vector>

#include "bodymodel/tracking/frame_energy.h"
#include "core/finding.h"

namespace atelier {

/// Frames whose keypoints are no person's in metres.
struct OtherUnits {
  std::vector<std::size_t> frames;  ///< increasing
  double least = 0;  ///< m, how far half of the keypoints of a frame lie from their middle: the
  double most = 0;   ///< smallest and the largest of those frames

  bool is_one(std::size_t frame) const;
};

/// Takes away the keypoints of frames in which half of those that are seen lie less than 1 cm or
/// more than 3 m from their middle (a hand is larger, somebody with arms stretched out smaller),
/// whatever single ones do. Frames of which fewer than three are seen say nothing. O(F K).
OtherUnits without_other_units(std::vector<FrameTargets>& frames);

/// "keypoint-unit", one line of all such frames.
/// @param frame_ids  [F] of all frames
/// @param instead    what becomes of those frames, behind "left out; "
Finding keypoint_unit(const OtherUnits& others, const std::vector<int>& frame_ids,
                      const std::string& instead);

}  // namespace atelier
