#pragma once

#include <optional>
#include <string>

#include "core/finding.h"

namespace atelier {

/// How a file says its frame rate.
enum class RateStated {
  Rate,  ///< frames a second: C3D, TRC, npz
  Time,  ///< the time of a frame: BVH
  Keys,  ///< the times of all frames: glTF, FBX
};

/// Judges the frame rate of a motion file. Nothing of 1 to 1,000 frames a second, as people are
/// recorded; a warning ("fps-odd") of what is beyond, with what it looks like (milliseconds, a rate
/// in the place of a time and the other way round) and how another is set. Throws DataError, saying
/// the same, below a frame in 100 s and beyond 100,000 a second, which no motion has.
std::optional<Finding> odd_frame_rate(double fps, RateStated stated, const std::string& file);

}  // namespace atelier
