#pragma once

#include "simulation/contact/self_push_math.h"

namespace atelier {

/// PushSum::used, 0 before: a pair wants something of the particle, or did in this substep.
constexpr int kPushed = 1;
constexpr int kWasPushed = 2;
constexpr int kWasKept = 3;

__device__ inline PushSum load_sum(const PushSum* place) {
  static_assert(sizeof(PushSum) == 4 * sizeof(int4));
  PushSum out;
  int4* const words = reinterpret_cast<int4*>(&out);
#pragma unroll
  for (int k = 0; k < 4; ++k) {
    words[k] = __ldcg(reinterpret_cast<const int4*>(place) + k);
  }
  return out;
}
__device__ inline void clear_sum(PushSum* place, int used) {
  PushSum none{};
  none.used = used;
  const int4* const words = reinterpret_cast<const int4*>(&none);
#pragma unroll
  for (int k = 0; k < 4; ++k) {
    __stcg(reinterpret_cast<int4*>(place) + k, words[k]);
  }
}

template <class T>
__device__ inline void widen(PushExtent& extent, Vec3<T> push) {
  const int units[3] = {to_units(push.x), to_units(push.y), to_units(push.z)};
#pragma unroll
  for (int k = 0; k < 3; ++k) {
    if (units[k] > 0) {
      atomicMax(&extent.high[k], units[k]);
    } else if (units[k] < 0) {
      atomicMin(&extent.low[k], units[k]);
    }
  }
}

/// Adds what one pair wants of a particle.
template <class T>
__device__ inline void add_push(PushSum* sum, Vec3<T> fresh, Vec3<T> calm, int level) {
  __stcg(&sum->used, kPushed);
  widen(sum->fresh, fresh);
  widen(sum->calm, calm);
  if (level > 0) {
    atomicMax(&sum->support, level);
  }
}

}  // namespace atelier
