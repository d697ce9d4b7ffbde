#pragma once

#include <string>

#include "bodymodel/motion_clip.h"

namespace atelier {

/// The motion with a pose for every frame from the first to the last, for formats that hold no
/// frame numbers: where numbers are missing, poses between those of the neighbours (the short way
/// round); where all numbers go on by the same step, the rate divided by it. Frame ids go on by 1
/// from the first. Throws DataError, with the gap, where the frames that are missing are more than
/// four times those that are there and more than fill 4 million joints.
Motion without_gaps(const Motion& motion, const std::string& file = "");

/// The same of a clip that was read, with a finding where frames were missing ("motion-gaps").
void fill_missing_frames(MotionClip& clip, const std::string& file);

}  // namespace atelier
