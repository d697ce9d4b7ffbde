#pragma once

#include "core/cuda_check.h"

namespace atelier {

/// Kernels of a recorded stream of which each begins while the last blocks of the one before still
/// run (programmatic dependent launch): a launch takes as long as some of these kernels. Each waits
/// before it reads what others wrote, or writes; so it is over after all before it.
__device__ inline void wait_for_kernels_before() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  asm volatile("griddepcontrol.wait;" ::: "memory");
  asm volatile("griddepcontrol.launch_dependents;" ::: "memory");
#endif
}

/// Launches a kernel that begins with wait_for_kernels_before().
template <class Kernel, class... Arguments>
void launch_in_chain(Kernel kernel, unsigned blocks, int threads, cudaStream_t stream,
                     const Arguments&... arguments) {
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(blocks);
  config.blockDim = dim3(static_cast<unsigned>(threads));
  config.stream = stream;
  cudaLaunchAttribute attribute{};
  attribute.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  attribute.val.programmaticStreamSerializationAllowed = 1;
  config.attrs = &attribute;
  config.numAttrs = stream == cudaStreamLegacy ? 0 : 1;
  ATELIER_CUDA_CHECK(cudaLaunchKernelEx(&config, kernel, arguments...));
}

}  // namespace atelier
