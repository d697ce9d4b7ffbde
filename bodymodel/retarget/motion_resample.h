#pragma once

#include "bodymodel/interpolated_pose.h"
#include "core/pose.h"

namespace atelier {

/// The pose at a time from the first frame on: through every frame, along curves whose speed does
/// not jump (Catmull and Rom 1974, of root translations and, component by component and then
/// normalised, of quaternions; the first and the last speed are those between the outermost two
/// frames): what drives a simulation, which a linear path would push at every frame. Before the
/// first frame and behind the last it stands still. Throws LogicError for a
/// motion without poses or rate.
Pose smooth_pose(const Motion& motion, double seconds);

/// The motion at another rate: same start, same duration, frame ids from 0. Rotations take the
/// short way between frames; nothing is smoothed. Throws LogicError unless both rates are positive,
/// DataError for more than Limits::frames.
Motion resampled(const Motion& motion, double fps);

}  // namespace atelier
