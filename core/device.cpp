#include "core/device.h"

#include "core/error.h"

#ifdef ATELIER_HAS_CUDA
#include <cuda_runtime_api.h>
#endif

namespace atelier {

const char* device_name(Device device) {
  return device == Device::Cuda ? "cuda" : "cpu";
}

bool cuda_available() {
#ifdef ATELIER_HAS_CUDA
  int count = 0;
  return cudaGetDeviceCount(&count) == cudaSuccess && count > 0;
#else
  return false;
#endif
}

void check_device(Device device) {
  if (device == Device::Cuda && !cuda_available()) {
#ifdef ATELIER_HAS_CUDA
    throw EnvironmentError("CUDA", "no device answers");
#else
    throw EnvironmentError("CUDA", "this build has none");
#endif
  }
}

}  // namespace atelier
