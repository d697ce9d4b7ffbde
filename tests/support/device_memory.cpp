#include "tests/support/device_memory.h"

#include <atomic>
#include <limits>
#include <stdexcept>
#include <string>

namespace {

std::atomic<int> left{std::numeric_limits<int>::max()};
std::atomic<int> failures{0};
std::atomic<int> made{0};
std::atomic<int> alive{0};

}  // namespace

// The linker's names (--wrap).
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" {

cudaError_t __real_cudaMalloc(void** memory, std::size_t bytes);
cudaError_t __real_cudaFree(void* memory);

cudaError_t __wrap_cudaMalloc(void** memory, std::size_t bytes) {
  if (left == 0) {
    ++failures;
    // More than any device has: the runtime remembers the error as it does a true one.
    static_cast<void>(__real_cudaMalloc(memory, std::numeric_limits<std::size_t>::max() / 4));
    *memory = nullptr;
    return cudaErrorMemoryAllocation;
  }
  const cudaError_t status = __real_cudaMalloc(memory, bytes);
  if (status == cudaSuccess) {
    ++made;
    ++alive;
    if (left != std::numeric_limits<int>::max()) {
      --left;
    }
  }
  return status;
}

cudaError_t __wrap_cudaFree(void* memory) {
  const cudaError_t status = __real_cudaFree(memory);
  if (memory != nullptr && status == cudaSuccess) {
    --alive;
  }
  return status;
}
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

namespace atelier::fixtures {

EndOfDeviceMemory::EndOfDeviceMemory(int good) {
  left = good;
  failures = 0;
}

EndOfDeviceMemory::~EndOfDeviceMemory() {
  left = std::numeric_limits<int>::max();
}

int EndOfDeviceMemory::failed() {
  return failures;
}

int device_allocations() {
  return made;
}

int device_allocations_alive() {
  return alive;
}

FullDevice::FullDevice() {
  constexpr std::size_t kLeast = std::size_t{64} << 10;
  for (std::size_t bytes = std::size_t{1} << 30; bytes >= kLeast;) {
    void* memory = nullptr;
    const cudaError_t status = __real_cudaMalloc(&memory, bytes);
    if (status == cudaSuccess) {
      taken_.push_back(memory);
      continue;
    }
    static_cast<void>(cudaGetLastError());
    if (status != cudaErrorMemoryAllocation) {
      this->~FullDevice();
      throw std::runtime_error(std::string("cudaMalloc: ") + cudaGetErrorString(status));
    }
    bytes /= 2;
  }
}

FullDevice::~FullDevice() {
  for (void* memory : taken_) {
    static_cast<void>(__real_cudaFree(memory));
  }
  taken_.clear();
  static_cast<void>(cudaGetLastError());
}

}  // namespace atelier::fixtures
