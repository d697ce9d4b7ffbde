#pragma once

#include <atomic>

#include "simulation/contact/collision_response_math.h"

namespace atelier {

/// Pushes of many pairs on the CPU, summed up by threads (see ResponseSum): extremes, so that their
/// order does not matter.

/// Raises a number that other threads may raise too.
inline void raise_to(int& place, int value) {
  const std::atomic_ref<int> shared(place);
  int seen = shared.load(std::memory_order_relaxed);
  while (seen < value && !shared.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
}

inline void lower_to(int& place, int value) {
  const std::atomic_ref<int> shared(place);
  int seen = shared.load(std::memory_order_relaxed);
  while (seen > value && !shared.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
}

/// Takes a push into the extremes.
template <class T>
inline void widen(ResponseExtent& extent, Vec3<T> push) {
  const int units[3] = {to_units(push.x), to_units(push.y), to_units(push.z)};
  for (int k = 0; k < 3; ++k) {
    if (units[k] > 0) {
      raise_to(extent.high[k], units[k]);
    } else if (units[k] < 0) {
      lower_to(extent.low[k], units[k]);
    }
  }
}

/// Adds what one pair wants of it.
template <class T>
inline void add_response(ResponseSum& sum, Vec3<T> fresh, Vec3<T> calm, int level) {
  raise_to(sum.used, 1);
  widen(sum.fresh, fresh);
  widen(sum.calm, calm);
  raise_to(sum.support, level);
}

}  // namespace atelier
