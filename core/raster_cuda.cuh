#pragma once

#include "core/cuda_buffer.cuh"
#include "core/raster_cuda.h"

namespace atelier {

/// A Raster in device memory.
struct CudaRaster {
  CudaBuffer<int> face;           ///< [H,W]
  CudaBuffer<float> barycentric;  ///< [H,W,3]
  CudaBuffer<float> depth;        ///< [H,W]
};

/// Draws `face_count` faces ([F,3] into vertices); pointers are to device memory. The preconditions
/// of rasterize are the caller's to check.
CudaRaster rasterize_on_device(const ScreenVertex* vertices, const int* faces, int face_count,
                               int width, int height, const RasterOptions& options);

}  // namespace atelier
