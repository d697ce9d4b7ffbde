#include "simulation/xpbd/cuda_frame_kernel.cuh"

namespace atelier {

template FrameStepKernel<float> frame_step_kernel_of<float>();
template FrameStepKernel<double> frame_step_kernel_of<double>();

}  // namespace atelier
