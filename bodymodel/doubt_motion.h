#pragma once

#include <vector>

#include "bodymodel/motion_clip.h"

namespace atelier {

/// What is odd in a motion, in metres, and may be damage of its file: a person who leaps ("motion-
/// jump": more than a metre from one frame to the next, faster than 20 m/s, with the first such
/// frame) and bones of no person ("motion-bone": 2.5 times as long as its legs, with the longest).
/// Nothing of a skeleton without a person in it.
std::vector<Finding> doubt_motion(const MotionClip& clip);

}  // namespace atelier
