#include "simulation/xpbd/cuda_frame_kernel.cuh"

namespace atelier {

template FrameKernel<double> frame_kernel_of<double, FrameKind::Self, CudaBarrier::Block>();
template FrameKernel<double> frame_kernel_of<double, FrameKind::Self, CudaBarrier::Cluster>();
template FrameKernel<double> frame_kernel_of<double, FrameKind::Self, CudaBarrier::Grid>();

}  // namespace atelier
