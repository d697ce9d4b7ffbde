#if defined(ATELIER_HAS_CUDA)

#include "core/cuda_check.h"

#include <filesystem>
#include <string>

#include "core/error.h"

namespace atelier {

void check_cuda(cudaError_t status, const char* call, const char* file, int line) {
  if (status == cudaSuccess) {
    return;
  }
  static_cast<void>(cudaGetLastError());
  throw EnvironmentError(std::string("CUDA: ") + call + " at " +
                             std::filesystem::path(file).filename().string() + ":" +
                             std::to_string(line),
                         std::string(cudaGetErrorName(status)) + ": " + cudaGetErrorString(status));
}

void* allocate_cuda(std::size_t bytes) {
  if (bytes == 0) {
    return nullptr;
  }
  void* memory = nullptr;
  const cudaError_t status = cudaMalloc(&memory, bytes);
  if (status == cudaErrorMemoryAllocation) {
    static_cast<void>(cudaGetLastError());
    std::size_t free_bytes = 0;
    std::size_t total_bytes = 0;
    ATELIER_CUDA_CHECK(cudaMemGetInfo(&free_bytes, &total_bytes));
    throw EnvironmentError("CUDA device memory", "out of memory: " + std::to_string(bytes) +
                                                     " bytes asked for, " +
                                                     std::to_string(free_bytes) + " free of " +
                                                     std::to_string(total_bytes));
  }
  ATELIER_CUDA_CHECK(status);
  return memory;
}

void release_cuda(void* memory) noexcept {
  static_cast<void>(cudaFree(memory));
}

}  // namespace atelier

#endif
