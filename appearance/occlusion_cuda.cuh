#pragma once

#include "appearance/occlusion_cuda.h"

namespace atelier {

/// open_rays_cuda where everything lies on the device: `open` [2V] is overwritten. Waits for
/// nothing.
void open_rays_on_device(const TreeView<double>& tree, const Vec3d* positions, const Vec3d* normals,
                         int vertices, const AmbientRays& rays, OpenRays* open);

}  // namespace atelier
