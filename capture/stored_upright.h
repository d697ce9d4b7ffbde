#pragma once

#include <cstddef>

#include "capture/check_keypoints.h"
#include "capture/frame_reader.h"

namespace atelier {

/// Which way up the images of a camera are stored: 1 where they change from frame to frame where
/// the joints of the person are, as keypoints and calibration have them, and clearly less where
/// these would be in images that are turned by half; -1 where it is the other way round; 0 where
/// nobody moves, and where there is too little to tell. Decodes at most eight images.
int upright_as_stored(FrameReader& reader, const KeypointCheck& keypoints, std::size_t camera);

}  // namespace atelier
