#pragma once

#include <vector>

#include "bodymodel/motion_clip.h"

namespace atelier {

/// Defects of a motion, in metres, that may be damage of its file: a person who leaps ("motion-
/// jump": more than a metre from one frame to the next, faster than 20 m/s, with the first such
/// frame), bones that no person has ("motion-bone": 2.5 times as long as the legs, with the
/// longest) and a path in another unit than the bones ("motion-path-unit": hips at a tenth, a
/// hundredth, a thousandth, ten, a hundred or a thousand times the height of the legs, or feet that
/// slide unless the path is made longer), with the factor that mends it. None for a skeleton that
/// is no person's.
std::vector<Finding> check_motion(const MotionClip& clip);

}  // namespace atelier
