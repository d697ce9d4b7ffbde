#pragma once

#include <cmath>
#include <string>

#include "core/error.h"
#include "core/io/text_writer.h"

namespace atelier {

/// A number as the float that a file stores. Throws DataError, with `what` it is ("a position"), if
/// no float holds it: a writer would store infinity.
inline float to_float(double value, const char* what) {
  const float narrowed = static_cast<float>(value);
  if (!std::isfinite(narrowed)) {
    throw DataError("", "", std::string(what) + " of " + number_text(value),
                    "a number that a float holds, up to 3.4e+38");
  }
  return narrowed;
}

}  // namespace atelier
