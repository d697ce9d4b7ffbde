#include "core/device.h"

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

}  // namespace atelier
