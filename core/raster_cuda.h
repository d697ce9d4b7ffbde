#pragma once

#include <vector>

#include "core/raster.h"

namespace atelier {

/// Checks of rasterize on all arguments but the faces. Throws as it does.
void check_raster(const Points& vertices, const Camera& camera, const RasterOptions& options);

/// The face stage of rasterize on the GPU: screen vertices and faces go there, the raster comes
/// back. Kernels that keep everything on the device use rasterize_on_device (raster_cuda.cuh).
/// Throws EnvironmentError where a CUDA call fails.
Raster rasterize_cuda(const std::vector<ScreenVertex>& vertices, const Triangles& faces, int width,
                      int height, const RasterOptions& options);

}  // namespace atelier
