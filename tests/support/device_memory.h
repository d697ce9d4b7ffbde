#pragma once

#include <cstddef>
#include <vector>

#include <cuda_runtime_api.h>

namespace atelier::fixtures {

// The linker leads calls of cudaMalloc and cudaFree here (atelier_device_memory in
// tests/CMakeLists.txt): what a test program links takes device memory as it always does.

/// While one lives, so many more allocations of device memory succeed and all others fail, as where
/// memory ran out; also where there is no device.
class EndOfDeviceMemory {
 public:
  explicit EndOfDeviceMemory(int good);
  ~EndOfDeviceMemory();
  EndOfDeviceMemory(const EndOfDeviceMemory&) = delete;
  EndOfDeviceMemory& operator=(const EndOfDeviceMemory&) = delete;

  /// Of the allocations since it lives.
  static int failed();
};

/// Allocations of device memory since the program began, and those that live.
int device_allocations();
int device_allocations_alive();

/// Takes all the memory that the device has left, until the end of the scope. Others on the device
/// fail meanwhile. Throws std::runtime_error where memory is not what runs out.
class FullDevice {
 public:
  FullDevice();
  ~FullDevice();
  FullDevice(const FullDevice&) = delete;
  FullDevice& operator=(const FullDevice&) = delete;

 private:
  std::vector<void*> taken_;
};

}  // namespace atelier::fixtures
