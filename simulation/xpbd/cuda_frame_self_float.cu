#include "simulation/xpbd/cuda_frame_kernel.cuh"

namespace atelier {

template FrameKernel<float> frame_kernel_of<float, FrameKind::Self, CudaBarrier::Block>();
template FrameKernel<float> frame_kernel_of<float, FrameKind::Self, CudaBarrier::Cluster>();
template FrameKernel<float> frame_kernel_of<float, FrameKind::Self, CudaBarrier::Grid>();

}  // namespace atelier
