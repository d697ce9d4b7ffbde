#pragma once

#include <vector>

#include "capture/dataset.h"
#include "core/camera.h"
#include "core/finding.h"

namespace atelier {

/// Defects of a set of cameras that can be found without an image: focal lengths that no lens has,
/// principal points far off, distortion that folds within the image ("camera-distortion"), two
/// cameras in one place ("camera-twins"), cameras that look away from where the others look
/// ("camera-looks-away": an inverted or transposed extrinsic, a position in place of a
/// translation), another convention of all extrinsics that fits far better ("cameras-apart",
/// "extrinsics-doubtful") or as well ("extrinsics-untold", rig_convention.h), a stage whose size is
/// no stage's ("stage-size": millimetres), an up axis that no camera agrees with ("stage-up").
/// O(cameras^2 + cameras x pixels of the rim).
/// @param world  in which the calibrations were written, for the settings that are advised
std::vector<Finding> check_cameras(const std::vector<Camera>& cameras,
                                   const WorldConvention& world = {1, "y"});

/// The same of a capture's cameras as they hang: without the turns of their images.
std::vector<Finding> check_cameras(const Dataset& dataset);

}  // namespace atelier
