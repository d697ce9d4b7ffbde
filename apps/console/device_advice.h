#pragma once

#include <string>

#include "core/error.h"

namespace atelier {

/// Why the surroundings failed, with the flag that does without where it is the device or its
/// memory: the libraries that ask for one know no flags.
inline std::string with_device_advice(const EnvironmentError& error) {
  if (error.place == "CUDA device memory") {  // kDeviceMemory of core/cuda_check.h
    return error.reason +
           "; use --device cpu, end other programs on the device, or take less at a time: a "
           "coarser garment, smaller images";
  }
  const bool says_more = error.reason.find("; ") != std::string::npos;
  return error.reason + (error.place.starts_with("CUDA") && !says_more ? "; use --device cpu" : "");
}

}  // namespace atelier
