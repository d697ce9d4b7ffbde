#include "simulation/cuda_frame_kernel.cuh"

namespace atelier {

template FrameKernel<float> frame_kernel_of<float, FrameKind::Full>(CudaBarrier);

}  // namespace atelier
