#pragma once

/// Marks the arithmetic that CPU and CUDA twins share (`*_math.h`). Empty without nvcc.
#ifdef __CUDACC__
#define ATELIER_HOST_DEVICE __host__ __device__
#else
#define ATELIER_HOST_DEVICE
#endif
