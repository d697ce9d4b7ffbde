#pragma once

#include <string>

#include "capture/layouts/capture_facts.h"

namespace atelier {

// Why a capture has nothing for a stage that reads this of it: one sentence with the command that
// creates it, "" if it has.

/// Calibrated cameras, and masks of two of them or 2D keypoints.
std::string lacks_evidence(const CaptureFacts& facts);

/// Calibrated cameras and 2D keypoints.
std::string lacks_keypoints(const CaptureFacts& facts);

/// Frames with images and masks of two cameras.
std::string lacks_masks(const CaptureFacts& facts);

/// Such frames in a clothed sequence.
std::string lacks_clothes(const CaptureFacts& facts);

}  // namespace atelier
