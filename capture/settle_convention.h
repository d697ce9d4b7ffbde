#pragma once

#include <vector>

#include "capture/check_keypoints.h"
#include "capture/frame_reader.h"
#include "core/finding.h"

namespace atelier {

/// What check_cameras could not tell of the convention of all extrinsics ("extrinsics-untold",
/// "extrinsics-doubtful", "cameras-apart"), where detections or masks do: nothing is left of it
/// where detections fit the calibration as it was read; else the masks of the person are held
/// against each other under every convention under which the cameras look at one place
/// (silhouettes.h). Of one that they agree with alone the finding says so, with its setting, or is
/// gone if it is the one that was read. Reads the masks of two frames.
void settle_convention(std::vector<Finding>& findings, FrameReader& reader,
                       const KeypointCheck& keypoints);

}  // namespace atelier
