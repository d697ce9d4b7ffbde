#pragma once

#include "core/camera.h"
#include "core/image.h"
#include "core/render/prepared_scene.h"

namespace atelier {

/// Pixels a side of the squares that one thread renders at a time.
inline constexpr int kTile = 8;

/// The image's square whose first pixel is (x0, y0), smaller at the right and lower border. Private
/// to core/render; `render` has checked the arguments. `occupied` false promises that no mesh is
/// seen in it.
Image rendered_tile(const PreparedScene::Data& scene, const Camera& camera,
                    const RenderOptions& options, int x0, int y0, bool occupied);

}  // namespace atelier
