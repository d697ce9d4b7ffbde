#pragma once

#include "pipeline/pictures/paint_scene.h"

namespace atelier {

/// Draws every frame of a scene by the surfaces' normals alone, as paint_scene draws it by
/// networks: the same surfaces, cameras, background and hooks, and neither networks nor another
/// program. What is seen of a normal n in the camera's frame is the sRGB colour (1 + n_x, 1 - n_y,
/// 1 - n_z) / 2: red to the right, green upwards, blue towards the viewer; of either side of a
/// surface. True if all were drawn, false if it was stopped.
bool draw_normals(const PaintedScene& scene, const PaintOptions& options, const PaintHooks& hooks);

}  // namespace atelier
