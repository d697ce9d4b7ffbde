#include "simulation/xpbd/cuda_frame_kernel.cuh"

namespace atelier {

template FrameKernel<double> frame_kernel_of<double, FrameKind::Full, CudaBarrier::Block>();
template FrameKernel<double> frame_kernel_of<double, FrameKind::Full, CudaBarrier::Cluster>();
template FrameKernel<double> frame_kernel_of<double, FrameKind::Full, CudaBarrier::Grid>();

}  // namespace atelier
