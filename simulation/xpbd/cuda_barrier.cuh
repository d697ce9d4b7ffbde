#pragma once

#include <cooperative_groups.h>

#include "simulation/cloth/vec4.h"

namespace atelier {

/// How the blocks of one scene wait for each other between phases.
enum class CudaBarrier {
  Block,    ///< one block a scene: no other to wait for
  Cluster,  ///< up to 16 blocks on neighbouring multiprocessors
  Grid      ///< blocks anywhere (launched together), through a counter in memory
};

/// Positions that other blocks write: read from the cache that all of them share.
__device__ inline Vec4<float> load_shared_cache(const Vec4<float>* p) {
  const float4 v = __ldcg(reinterpret_cast<const float4*>(p));
  return {v.x, v.y, v.z, v.w};
}
__device__ inline Vec4<double> load_shared_cache(const Vec4<double>* p) {
  const double2 a = __ldcg(reinterpret_cast<const double2*>(p));
  const double2 b = __ldcg(reinterpret_cast<const double2*>(p) + 1);
  return {a.x, a.y, b.x, b.y};
}
__device__ inline void store_shared_cache(Vec4<float>* p, const Vec4<float>& v) {
  __stcg(reinterpret_cast<float4*>(p), make_float4(v.x, v.y, v.z, v.w));
}
__device__ inline void store_shared_cache(Vec4<double>* p, const Vec4<double>& v) {
  __stcg(reinterpret_cast<double2*>(p), make_double2(v.x, v.y));
  __stcg(reinterpret_cast<double2*>(p) + 1, make_double2(v.z, v.w));
}

/// Waits until every block of the scene has come here; what they wrote before is visible after.
template <CudaBarrier kBarrier>
__device__ inline void scene_barrier(unsigned* arrived, unsigned& goal, unsigned blocks) {
  if constexpr (kBarrier == CudaBarrier::Block) {
    __syncthreads();
  } else if constexpr (kBarrier == CudaBarrier::Cluster) {
#if __CUDA_ARCH__ >= 900
    cooperative_groups::this_cluster().sync();
#endif
  } else {
    __syncthreads();
    goal += blocks;
    if (threadIdx.x == 0) {
      __threadfence();
      atomicAdd(arrived, 1u);
      unsigned seen = 0;
      do {
        asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(seen) : "l"(arrived) : "memory");
      } while (seen < goal);
    }
    __syncthreads();
  }
}

/// A block leaves: the last one of the scene sets the counters back for the next launch.
template <CudaBarrier kBarrier>
__device__ inline void leave_scene(unsigned* arrived, unsigned blocks) {
  if constexpr (kBarrier == CudaBarrier::Grid) {
    if (threadIdx.x == 0 && atomicAdd(arrived + 1, 1u) + 1 == blocks) {
      arrived[0] = 0;
      arrived[1] = 0;
    }
  }
}

}  // namespace atelier
