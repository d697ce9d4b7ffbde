#pragma once

#include "core/cuda_buffer.cuh"
#include "core/raster_cuda.h"

namespace atelier {

/// A Raster in device memory.
struct CudaRaster {
  CudaBuffer<int> face;                 ///< [H,W]
  CudaBuffer<float> barycentric;        ///< [H,W,3]
  CudaBuffer<float> depth;              ///< [H,W]
  CudaBuffer<unsigned long long> keys;  ///< [H,W] working memory
};

/// Draws `face_count` faces ([F,3] into vertices) into `raster`; pointers are to device memory. Its
/// memory is taken anew only for another size of image, and nothing is waited for. The
/// preconditions of rasterize are the caller's to check.
void rasterize_on_device(const ScreenVertex* vertices, const int* faces, int face_count, int width,
                         int height, const RasterOptions& options, CudaRaster& raster);

}  // namespace atelier
