#include "simulation/projective/cuda_projective.cuh"
#include "simulation/xpbd/cuda_self_substep.cuh"

namespace atelier {
namespace {

/// Contacts of a substep after its iterations; cooperative. The clock goes from one launch to the
/// next.
__global__ void __launch_bounds__(kFrameThreads, 1)
    self_kernel(const __grid_constant__ CudaFrame<double> frame, int blocks, int s,
                SelfClock* clock_memory) {
  constexpr CudaBarrier kBarrier = CudaBarrier::Grid;
  unsigned goal = 0;
  SelfClock clock;
  if (s > 0) {
    clock = *clock_memory;
  }
  touch_before_pairs<double, kBarrier>(frame, blocks, s, 0, clock, frame.arrived, goal);
  push_apart_all<double, kBarrier>(frame, blocks, s, s + 1 == frame.substeps, clock, frame.arrived,
                                   goal);
  keep_all_back<double, kBarrier>(frame, blocks, s, clock, frame.arrived, goal);
  if (blockIdx.x == 0 && threadIdx.x == 0) {  // the others read it long before
    *clock_memory = clock;
  }
  leave_scene<kBarrier>(frame.arrived, static_cast<unsigned>(blocks));
}

int blocks_of_self_kernel() {
  int device = 0;
  int multiprocessors = 0;
  int resident = 0;
  ATELIER_CUDA_CHECK(cudaGetDevice(&device));
  ATELIER_CUDA_CHECK(
      cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  ATELIER_CUDA_CHECK(
      cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, self_kernel, kFrameThreads, 0));
  ATELIER_CHECK(resident > 0, "contacts do not fit on a multiprocessor");
  return multiprocessors;
}

}  // namespace

void launch_projective_self(const CudaFrame<double>& frame, int s, SelfClock* clock,
                            cudaStream_t stream) {
  const int blocks = blocks_of_self_kernel();
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(static_cast<unsigned>(blocks));
  config.blockDim = dim3(kFrameThreads);
  config.stream = stream;
  cudaLaunchAttribute attribute{};
  attribute.id = cudaLaunchAttributeCooperative;
  attribute.val.cooperative = 1;
  config.attrs = &attribute;
  config.numAttrs = 1;
  ATELIER_CUDA_CHECK(cudaLaunchKernelEx(&config, self_kernel, frame, blocks, s, clock));
}

std::size_t projective_clock_size() {
  return sizeof(SelfClock);
}

}  // namespace atelier
