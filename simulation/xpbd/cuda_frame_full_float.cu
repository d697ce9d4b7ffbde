#include "simulation/xpbd/cuda_frame_kernel.cuh"

namespace atelier {

template FrameKernel<float> frame_kernel_of<float, FrameKind::Full, CudaBarrier::Block>();
template FrameKernel<float> frame_kernel_of<float, FrameKind::Full, CudaBarrier::Cluster>();
template FrameKernel<float> frame_kernel_of<float, FrameKind::Full, CudaBarrier::Grid>();

}  // namespace atelier
