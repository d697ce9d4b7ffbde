#include "simulation/xpbd/cuda_frame_kernel.cuh"

namespace atelier {

template FrameKernel<double> frame_kernel_of<double, FrameKind::FullOfFew, CudaBarrier::Grid>();
template FrameKernel<double> frame_kernel_of<double, FrameKind::SelfOfFew, CudaBarrier::Grid>();

}  // namespace atelier
