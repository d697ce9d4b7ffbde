#include "simulation/xpbd/cuda_frame_kernel.cuh"

namespace atelier {

template FrameKernel<float> frame_kernel_of<float, FrameKind::FullOfFew, CudaBarrier::Grid>();
template FrameKernel<float> frame_kernel_of<float, FrameKind::SelfOfFew, CudaBarrier::Grid>();

}  // namespace atelier
