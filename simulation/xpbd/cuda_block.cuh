#pragma once

#include "simulation/xpbd/cuda_barrier.cuh"
#include "simulation/xpbd/cuda_scene.cuh"

namespace atelier {

/// Data of one block: its scene, its share of the patches, its on-chip memory.
template <class T>
struct BlockWork {
  const CudaFrame<T>& frame;
  CudaSceneRule<T> rule;
  SubstepScale<T> scale;
  int scene, block, blocks, offset;
  Vec4<T>* x;      ///< particles of the patch in hand
  Vec4<T>* start;  ///< where they were at the start of the substep
  unsigned char* plan_room;

  /// On-chip memory before the plans: positions and, where they are kept, starts.
  static __host__ __device__ std::size_t room(int particles, bool starts) {
    const std::size_t bytes =
        (starts ? 2 : 1) * static_cast<std::size_t>(particles) * sizeof(Vec4<T>);
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
    plan_room = memory + room(f.max_patch_particles, f.keeps_starts != 0);
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

  /// Patches of phase 0 that this block owns: loads their particles on chip, calls `work(patch)`.
  template <class Work>
  __device__ void owned_patches(const Work& work) const {
    const Schedule::Phase range = frame.phases[0];
    for (int k = range.patch_begin + block; k < range.patch_end; k += blocks) {
      const Schedule::Patch patch = frame.patches[k];
      for (int v = patch.vertex_begin + static_cast<int>(threadIdx.x); v < patch.vertex_end;
           v += static_cast<int>(blockDim.x)) {
        x[v - patch.vertex_begin] = load_shared_cache(frame.x + offset + v);
        if (frame.keeps_starts != 0) {
          start[v - patch.vertex_begin] = load_shared_cache(frame.start + offset + v);
        }
      }
      work(patch);
      __syncthreads();
    }
  }
};

}  // namespace atelier
