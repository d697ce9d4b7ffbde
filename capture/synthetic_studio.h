#pragma once

#include <vector>

#include "core/camera.h"
#include "core/render/scene.h"

namespace atelier {

/// A capture studio: two soft boxes overhead, grey seamless paper under and behind the subject, and
/// the rig that the cameras hang on (posts, a ring, housings), which each sees of the others. The
/// subject stands at the origin; nothing of the rig comes nearer to it than a camera.
Scene studio_surroundings(const std::vector<Camera>& cameras);

/// m, half side of the floor on which the subject's soft shadow lies (PrepareOptions).
inline constexpr double kStudioFloor = 2.0;

}  // namespace atelier
