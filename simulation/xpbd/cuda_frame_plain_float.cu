#include "simulation/xpbd/cuda_frame_kernel.cuh"

namespace atelier {

template FrameKernel<float> frame_kernel_of<float, FrameKind::Plain, CudaBarrier::Block>();
template FrameKernel<float> frame_kernel_of<float, FrameKind::Plain, CudaBarrier::Cluster>();
template FrameKernel<float> frame_kernel_of<float, FrameKind::Plain, CudaBarrier::Grid>();

}  // namespace atelier
