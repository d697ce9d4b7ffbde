#pragma once

#include <string>

#include "core/error.h"

namespace atelier {

/// Why the surroundings failed, with the flag that does without where it is the device: the
/// libraries that ask for one know no flags.
inline std::string with_device_advice(const EnvironmentError& error) {
  const bool says_more = error.reason.find("; ") != std::string::npos;
  return error.reason + (error.place == "CUDA" && !says_more ? "; say --device cpu" : "");
}

}  // namespace atelier
