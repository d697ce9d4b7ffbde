#if defined(ATELIER_HAS_CUDA)

#include "core/cuda_check.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

#include "core/error.h"

namespace atelier {

namespace {

std::string size_text(std::size_t bytes) {
  if (bytes < 1'000'000) {
    return std::to_string(bytes) + " bytes";
  }
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.1f MB", static_cast<double>(bytes) / 1e6);
  return text.data();
}

/// `what` did not fit. Where even a context does not, nobody can say how much is free.
EnvironmentError out_of_device_memory(const std::string& what) {
  std::size_t free_bytes = 0;
  std::size_t total_bytes = 0;
  std::string reason = "out of memory: " + what;
  if (cudaMemGetInfo(&free_bytes, &total_bytes) == cudaSuccess) {
    reason += ", " + size_text(free_bytes) + " free of " + size_text(total_bytes);
  }
  static_cast<void>(cudaGetLastError());
  return {kDeviceMemory, reason};
}

}  // namespace

void check_cuda(cudaError_t status, const char* call, const char* file, int line) {
  if (status == cudaSuccess) {
    return;
  }
  static_cast<void>(cudaGetLastError());
  const std::string place =
      std::filesystem::path(file).filename().string() + ":" + std::to_string(line);
  if (status == cudaErrorMemoryAllocation) {
    throw out_of_device_memory(std::string("in ") + call + " at " + place);
  }
  throw EnvironmentError(std::string("CUDA: ") + call + " at " + place,
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
    throw out_of_device_memory(size_text(bytes) + " asked for");
  }
  ATELIER_CUDA_CHECK(status);
  return memory;
}

void release_cuda(void* memory) noexcept {
  static_cast<void>(cudaFree(memory));
}

}  // namespace atelier

#endif
