#pragma once

#include <algorithm>

namespace atelier {

/// 0 up to `low`, 1 from `high` on, and between them the cubic whose slope is zero at both ends.
inline double smooth_step(double x, double low, double high) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace atelier
