#pragma once

#include "simulation/contact/collision_response_math.h"

namespace atelier {

/// ResponseSum::used, 0 before: a pair wants something of the particle, or did in this substep.
constexpr int kPushed = 1;
constexpr int kWasPushed = 2;
constexpr int kWasKept = 3;

__device__ inline ResponseSum load_sum(const ResponseSum* place) {
  static_assert(sizeof(ResponseSum) == 4 * sizeof(int4));
  ResponseSum out;
  int4* const words = reinterpret_cast<int4*>(&out);
#pragma unroll
  for (int k = 0; k < 4; ++k) {
    words[k] = __ldcg(reinterpret_cast<const int4*>(place) + k);
  }
  return out;
}
__device__ inline void clear_sum(ResponseSum* place, int used) {
  ResponseSum none{};
  none.used = used;
  const int4* const words = reinterpret_cast<const int4*>(&none);
#pragma unroll
  for (int k = 0; k < 4; ++k) {
    __stcg(reinterpret_cast<int4*>(place) + k, words[k]);
  }
}

template <class T>
__device__ inline void widen(ResponseExtent& extent, Vec3<T> push) {
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
__device__ inline void add_response(ResponseSum* sum, Vec3<T> fresh, Vec3<T> calm, int level) {
  __stcg(&sum->used, kPushed);
  widen(sum->fresh, fresh);
  widen(sum->calm, calm);
  if (level > 0) {
    atomicMax(&sum->support, level);
  }
}

}  // namespace atelier
