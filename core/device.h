#pragma once

namespace atelier {

/// Where a twin runs. `Cuda` throws EnvironmentError where the build or the machine has none.
enum class Device { Cpu, Cuda };

/// "cpu" or "cuda".
const char* device_name(Device device);

/// True if this build has CUDA and a device answers.
bool cuda_available();

/// Throws EnvironmentError if `device` is Cuda and there is none. Every twin's face calls it first.
void check_device(Device device);

}  // namespace atelier
