#pragma once

#include "simulation/cuda_barrier.cuh"
#include "simulation/cuda_scene.cuh"

namespace atelier {

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

/// What one block works with: its scene, its share of the patches, its on-chip memory.
template <class T>
struct BlockWork {
  const CudaFrame<T>& frame;
  CudaSceneRule<T> rule;
  SubstepScale<T> scale;
  int scene, block, blocks, offset;
  Vec4<T>* x;      ///< particles of the patch in hand
  Vec4<T>* start;  ///< where they were at the start of the substep
  unsigned char* plan_room;
  int* touching;  ///< places in the patch of particles that may touch the body
  int* touching_count;

  /// On-chip memory before the plans: positions, starts and, with a body, who may touch it.
  static __host__ __device__ std::size_t room(int particles, bool starts, bool body) {
    const std::size_t n = static_cast<std::size_t>(particles);
    const std::size_t bytes =
        (starts ? 2 : 1) * n * sizeof(Vec4<T>) + (body ? (n + 2) * sizeof(int) : 0);
    return (bytes + 31) / 32 * 32;
  }

  __device__ BlockWork(const CudaFrame<T>& f, int blocks_per_scene, unsigned char* memory)
      : frame(f),
        scene(static_cast<int>(blockIdx.x) / blocks_per_scene),
        block(static_cast<int>(blockIdx.x) % blocks_per_scene),
        blocks(blocks_per_scene) {
    offset = scene * f.count;
    rule = f.rules[scene];
    scale = substep_scale(f.h, f.damping, rule.spring_softness, rule.hinge_softness);
    x = reinterpret_cast<Vec4<T>*>(memory);
    start = x + f.max_patch_particles;
    touching = reinterpret_cast<int*>(start + f.max_patch_particles);
    touching_count = touching + f.max_patch_particles;
    plan_room = memory + room(f.max_patch_particles, f.keeps_starts != 0, f.body.face_count > 0);
  }

  __device__ EdgeMultipliers<T>* lambda() const {
    return frame.lambda != nullptr
               ? frame.lambda + static_cast<std::int64_t>(scene) * frame.edge_count
               : nullptr;
  }
  __device__ T* strain_lambda() const {
    return frame.strain_lambda != nullptr
               ? frame.strain_lambda + static_cast<std::int64_t>(scene) * 3 * frame.strain_count
               : nullptr;
  }

  /// Takes up the last pushes of the cloth's contacts with itself.
  __device__ void settle(int i, Vec4<T>& xi, Vec4<T>& si) const {
    if (frame.self.sums == nullptr) {
      return;
    }
    PushSum* const place = frame.self.sums + i;
    const int used = __ldcg(&place->used);
    int level = 0;
    if (used != 0) {
      const PushSum sum = load_sum(place);
      level = sum.support;
      Vec4<T> off = load_shared_cache(frame.self.calm + i);
      take_push(sum, xi, si, off);
      si = with_w(xyz(si) + xyz(off), si.w);
      clear_sum(place, 0);
    }
    frame.self.moved[i] = used;
    const bool held = frame.body.face_count > 0 && __ldcg(frame.touched + i) != 0;
    __stcg(frame.self.support + i, held ? kSupportLevels : level);
  }

  /// Patches of phase 0 that this block owns: loads their particles on chip (after the last pushes
  /// where they `settle`), calls `work(patch)`.
  template <class Work>
  __device__ void owned_patches(bool settles, const Work& work) const {
    const Schedule::Phase range = frame.phases[0];
    for (int k = range.patch_begin + block; k < range.patch_end; k += blocks) {
      const Schedule::Patch patch = frame.patches[k];
      for (int v = patch.vertex_begin + static_cast<int>(threadIdx.x); v < patch.vertex_end;
           v += static_cast<int>(blockDim.x)) {
        Vec4<T> xi = load_shared_cache(frame.x + offset + v);
        if (frame.keeps_starts != 0) {
          Vec4<T> si = load_shared_cache(frame.start + offset + v);
          if (settles) {
            settle(offset + v, xi, si);
          }
          start[v - patch.vertex_begin] = si;
        }
        x[v - patch.vertex_begin] = xi;
      }
      work(patch);
      __syncthreads();
    }
  }
};

}  // namespace atelier
