#include "simulation/xpbd/cuda_frame_kernel.cuh"

namespace atelier {

template FrameKernel<double> frame_kernel_of<double, FrameKind::Plain, CudaBarrier::Block>();
template FrameKernel<double> frame_kernel_of<double, FrameKind::Plain, CudaBarrier::Cluster>();
template FrameKernel<double> frame_kernel_of<double, FrameKind::Plain, CudaBarrier::Grid>();

}  // namespace atelier
