#pragma once

#include <vector>

#include "bodymodel/motion_clip.h"

namespace atelier {

/// Defects of a motion, in metres, that may be damage of its file: a person who leaps ("motion-
/// jump": more than a metre from one frame to the next, faster than 20 m/s, with the first such
/// frame) and bones that no person has ("motion-bone": 2.5 times as long as the legs, with the
/// longest). None for a skeleton that is no person's.
std::vector<Finding> check_motion(const MotionClip& clip);

}  // namespace atelier
