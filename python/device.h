#pragma once

#include <string>

#include "core/device.h"

namespace atelier::python {

/// Of "cpu" or "cuda". Throws DataError for another name.
Device device_of(const std::string& name);

}  // namespace atelier::python
