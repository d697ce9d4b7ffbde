#pragma once

#include <cstddef>

#include <cuda_runtime_api.h>

namespace atelier {

/// Where EnvironmentError says that memory of the device ran out.
inline constexpr const char* kDeviceMemory = "CUDA device memory";

/// Throws EnvironmentError naming the call, file:line and the CUDA error unless `status` is
/// success; where memory of the device ran out, which every call may report, its place is
/// kDeviceMemory and it says how much is free. Clears the error, so that the next check does not
/// report it again. Use ATELIER_CUDA_CHECK.
void check_cuda(cudaError_t status, const char* call, const char* file, int line);

/// Device memory of `bytes` bytes (nothing for 0), as every buffer takes it. Throws
/// EnvironmentError; where memory ran out its place is kDeviceMemory, and it says how much was
/// asked for and how much is free.
void* allocate_cuda(std::size_t bytes);

/// Gives memory of allocate_cuda back. Null is allowed.
void release_cuda(void* memory) noexcept;

/// Threads of one block, where a kernel has no reason for another number.
inline constexpr int kCudaBlock = 128;

/// Blocks of `block` threads that cover n items.
inline unsigned cuda_blocks(std::ptrdiff_t n, int block = kCudaBlock) {
  return static_cast<unsigned>((n + block - 1) / block);
}

}  // namespace atelier

/// Around every call of the CUDA runtime.
#define ATELIER_CUDA_CHECK(call) ::atelier::check_cuda((call), #call, __FILE__, __LINE__)

/// After every launch: `kernel<<<blocks, threads>>>(...); ATELIER_CUDA_LAUNCHED(kernel);`
/// Faults inside the kernel show up at the next synchronising call, which is checked as well.
#define ATELIER_CUDA_LAUNCHED(kernel) \
  ::atelier::check_cuda(cudaGetLastError(), "launch of " #kernel, __FILE__, __LINE__)
