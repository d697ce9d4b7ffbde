#pragma once

#include <vector>

#include "appearance/occlusion_math.h"
#include "core/tree.h"

namespace atelier {

/// open_rays of all rows on the GPU, [2V]: outside and inside of each vertex. `normals` are unit.
/// Throws EnvironmentError where a CUDA call fails.
std::vector<OpenRays> open_rays_cuda(const TriangleTree& tree, const std::vector<Vec3d>& positions,
                                     const std::vector<Vec3d>& normals, const AmbientRays& rays);

}  // namespace atelier
