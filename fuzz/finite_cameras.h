#pragma once

#include <vector>

#include "core/camera.h"
#include "core/error.h"

namespace atelier::fuzz {

/// What every reader of cameras promises: no NaN and no infinity gets in, whatever else is wrong.
inline void check_finite_cameras(const std::vector<Camera>& cameras) {
  for (const Camera& camera : cameras) {
    bool finite = camera.camera_from_world_translation.allFinite() &&
                  camera.camera_from_world_rotation.allFinite() && camera.width >= 0;
    for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy}) {
      finite = finite && value - value == 0;
    }
    for (const double value : camera.distortion) {
      finite = finite && value - value == 0;
    }
    ATELIER_CHECK(finite, "a camera with a number that is not finite");
  }
}

}  // namespace atelier::fuzz
