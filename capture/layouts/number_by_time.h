#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "capture/layouts/frame_files.h"

namespace atelier {

/// Numbers files that are named by time stamps, frame by frame, from 0: stamps of all cameras
/// within half the interval of frames are one frame (our choice; a later file of a camera within
/// it is left out). Files of a kind that follows (masks, keypoints) go to the frame that is nearest
/// to them. The unit is told by the digits (10 seconds, 13 milliseconds, 16 microseconds, 19
/// nanoseconds), and with it the frame rate, where the data set has none. A finding says so.
/// @param stamped  of each camera; none where its files have numbers
void number_by_time(Dataset& dataset, FrameLocations CameraFrames::*kind,
                    const std::vector<StampedFiles>& stamped, const std::string& place);

}  // namespace atelier
