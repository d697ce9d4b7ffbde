#pragma once

#include "simulation/contact/tree_math.h"
#include "simulation/xpbd/near_groups.h"

namespace atelier {

/// Boxes that the threads of a warp share.

constexpr unsigned kWholeWarp = 0xFFFFFFFFu;

/// Box over those of a warp's threads, of which some may be empty.
template <class T>
__device__ inline Box<T> united_in_warp(Box<T> box) {
  for (int k = kGroup / 2; k > 0; k /= 2) {
    const auto lower = [&](T v) { return min_of(v, __shfl_xor_sync(kWholeWarp, v, k)); };
    const auto higher = [&](T v) { return max_of(v, __shfl_xor_sync(kWholeWarp, v, k)); };
    box = {{lower(box.low.x), lower(box.low.y), lower(box.low.z)},
           {higher(box.high.x), higher(box.high.y), higher(box.high.z)}};
  }
  return box;
}

}  // namespace atelier
