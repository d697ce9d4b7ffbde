#pragma once

#include <cooperative_groups.h>

#include "simulation/cuda_scene.cuh"

namespace atelier {

constexpr int kFrameThreads = 512;

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

/// A record in 16-byte loads that do not go through the writable cache.
template <class T>
__device__ inline ConstraintRecord<T> load_record(const ConstraintRecord<T>* p) {
  static_assert(sizeof(ConstraintRecord<T>) % sizeof(uint4) == 0, "whole 16-byte words");
  union {
    ConstraintRecord<T> record;
    uint4 words[sizeof(ConstraintRecord<T>) / sizeof(uint4)];
  } out;
#pragma unroll
  for (unsigned w = 0; w < sizeof(ConstraintRecord<T>) / sizeof(uint4); ++w) {
    out.words[w] = __ldg(reinterpret_cast<const uint4*>(p) + w);
  }
  return out.record;
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

/// Constraints of a patch, colour after colour; the records of the next colour are on their way
/// while this one is projected.
template <class T>
__device__ inline void sweep_patch(const CudaFrame<T>& frame, int colour_count,
                                   const PreparedColour* colours, Vec4<T>* x, const Vec4<T>* start,
                                   T* lambda, T* strain_lambda, const SubstepScale<T>& scale,
                                   bool first_iteration) {
  const int tid = static_cast<int>(threadIdx.x);
  ConstraintRecord<T> next{};
  if (colour_count > 0 && colours[0].begin[0] + tid < colours[0].begin[3]) {
    next = load_record(frame.records + colours[0].begin[0] + tid);
  }
  for (int k = 0; k < colour_count; ++k) {
    const PreparedColour colour = colours[k];
    ConstraintRecord<T> record = next;
    if (k + 1 < colour_count && colours[k + 1].begin[0] + tid < colours[k + 1].begin[3]) {
      next = load_record(frame.records + colours[k + 1].begin[0] + tid);
    }
    for (int i = colour.begin[0] + tid; i < colour.begin[3];) {
      if (i < colour.begin[2]) {
        const T before = first_iteration ? T(0) : lambda[i];
        const T change = i < colour.begin[1]
                             ? project_hinge_record(record, x, start, before, scale)
                             : project_spring_record(record, x, start, before, scale);
        if (lambda != nullptr) {
          lambda[i] = before + change;
        }
      } else {
        const int s = colour.strain_begin + i - colour.begin[2];
        T values[3] = {T(0), T(0), T(0)};
        if (!first_iteration) {
          for (int c = 0; c < 3; ++c) {
            values[c] = strain_lambda[3 * s + c];
          }
        }
        project_strain_record(record, frame.strains[s], x, start, values, scale);
        if (strain_lambda != nullptr) {
          for (int c = 0; c < 3; ++c) {
            strain_lambda[3 * s + c] = values[c];
          }
        }
      }
      i += static_cast<int>(blockDim.x);
      if (i < colour.begin[3]) {
        record = load_record(frame.records + i);
      }
    }
    __syncthreads();
  }
}

/// Contact with the body at the end of an iteration of substep `s`.
template <class T>
__device__ inline void touch_body(const CudaFrame<T>& frame, int i, int s, T friction, Vec4<T>& x,
                                  Vec4<T>& start, Vec4<T>& held) {
  if (frame.body.face_count == 0 || !(x.w > T(0))) {
    return;
  }
  BodyContactRule<T> rule = frame.body_rule;
  rule.friction = friction;
  const T t0 = static_cast<T>(s) / static_cast<T>(frame.substeps);
  const T t1 = static_cast<T>(s + 1) / static_cast<T>(frame.substeps);
  const bool touched = contact_by_candidates(
      x, start, held, frame.body, t0, t1, rule, xyz(frame.frame_start[i]), frame.motion[i],
      frame.candidate_count[i], frame.candidates + static_cast<std::int64_t>(i) * kBodyCandidates);
  if (s + 1 == frame.substeps) {
    frame.touched[i] = touched ? 1 : 0;
  }
}

/// Contacts and velocity of particle `i` after the last iteration of substep `s`.
template <class T>
__device__ inline void finish_particle(const CudaFrame<T>& frame, int i, int s, T friction,
                                       Vec4<T>& x, Vec4<T>& start, Vec3<T>& velocity) {
  Vec4<T> held{};
  if (frame.held != nullptr) {
    held = frame.held[i];
  }
  touch_body(frame, i, s, friction, x, start, held);
  update_velocity(x, start, velocity, frame.h, frame.keep);
  if (!(isfinite(x.x) && isfinite(x.y) && isfinite(x.z))) {
    atomicMin(frame.bad, i);
  }
}

/// What one block works with: its scene, its share of the patches, its on-chip memory.
template <class T>
struct BlockWork {
  const CudaFrame<T>& frame;
  CudaSceneRule<T> rule;
  SubstepScale<T> scale;
  int scene, block, blocks, offset;
  T* lambda;
  T* strain_lambda;
  Vec4<T>* x;
  Vec4<T>* start;
  PreparedColour* colours;

  __device__ BlockWork(const CudaFrame<T>& f, int blocks_per_scene, unsigned char* memory)
      : frame(f),
        scene(static_cast<int>(blockIdx.x) / blocks_per_scene),
        block(static_cast<int>(blockIdx.x) % blocks_per_scene),
        blocks(blocks_per_scene) {
    offset = scene * f.count;
    rule = f.rules[scene];
    scale = {T(1) / (f.h * f.h), f.gamma, rule.spring_softness, rule.hinge_softness};
    const std::int64_t first = scene;
    lambda = f.lambda != nullptr ? f.lambda + first * f.record_count : nullptr;
    strain_lambda =
        f.strain_lambda != nullptr ? f.strain_lambda + first * 3 * f.strain_count : nullptr;
    x = reinterpret_cast<Vec4<T>*>(memory);
    start = x + f.max_patch_particles;
    colours =
        reinterpret_cast<PreparedColour*>(start + (f.gamma > T(0) ? f.max_patch_particles : 0));
  }

  /// Calls `visit(i)` for the particles that this block owns.
  template <class Visit>
  __device__ void owned(const Visit& visit) const {
    const Schedule::Phase phase = frame.phases[0];
    for (int k = phase.patch_begin + block; k < phase.patch_end; k += blocks) {
      const Schedule::Patch patch = frame.patches[k];
      for (int v = patch.vertex_begin + static_cast<int>(threadIdx.x); v < patch.vertex_end;
           v += static_cast<int>(blockDim.x)) {
        visit(v);
      }
    }
  }

  /// One phase of one iteration. In the first phase of the first iteration the owner also ends the
  /// last substep and begins this one.
  __device__ void phase(int s, int iteration, int p) const {
    const int tid = static_cast<int>(threadIdx.x);
    const int threads = static_cast<int>(blockDim.x);
    const bool damped = frame.gamma > T(0);
    const T share = T(1) / static_cast<T>(frame.substeps - s);
    const Schedule::Phase range = frame.phases[p];
    for (int k = range.patch_begin + block; k < range.patch_end; k += blocks) {
      const Schedule::Patch patch = frame.patches[k];
      const int count = patch.vertex_end - patch.vertex_begin;
      const int colour_count = patch.colour_end - patch.colour_begin;
      for (int c = tid; c < colour_count; c += threads) {
        colours[c] = frame.colours[patch.colour_begin + c];
      }
      for (int v = tid; v < count; v += threads) {
        const int i = offset + frame.patch_particles[patch.vertex_begin + v];
        Vec4<T> xi = load_shared_cache(frame.x + i);
        if (p == 0 && iteration == 0) {
          const Vec4<T> si = begin_particle(i, s, share, xi);
          if (damped) {
            start[v] = si;
          }
        } else if (damped) {
          start[v] = load_shared_cache(frame.start + i);
        }
        x[v] = xi;
      }
      __syncthreads();
      sweep_patch(frame, colour_count, colours, x, start, lambda, strain_lambda, scale,
                  iteration == 0);
      for (int v = tid; v < count; v += threads) {
        store_shared_cache(frame.x + offset + frame.patch_particles[patch.vertex_begin + v], x[v]);
      }
      __syncthreads();
    }
  }

  __device__ Vec4<T> begin_particle(int i, int s, T share, Vec4<T>& xi) const {
    Vec4<T> si = s > 0 ? load_shared_cache(frame.start + i) : xi;
    const Vec4<T> v4 = frame.velocity[i];
    Vec3<T> vi = xyz(v4);
    if (s > 0) {
      finish_particle(frame, i, s - 1, rule.friction, xi, si, vi);
    }
    Vec3<T> acceleration = frame.gravity;
    if (frame.air != nullptr) {
      acceleration += xyz(frame.air[i]);
    }
    const Vec3<T> target = xi.w > T(0) ? Vec3<T>{} : xyz(frame.target[i]);
    predict(xi, si, vi, acceleration, target, share, frame.h);
    store_shared_cache(frame.start + i, si);
    frame.velocity[i] = with_w(vi, T(0));
    if (frame.held != nullptr) {
      frame.held[i] = Vec4<T>{};
    }
    return si;
  }

  /// Tethers; anchors are fixed, so nobody moves them here.
  __device__ void tethers() const {
    owned([&](int v) {
      const int anchor = frame.tether_anchor[v];
      if (anchor >= 0) {
        Vec4<T> xi = load_shared_cache(frame.x + offset + v);
        project_tether(xi, xyz(load_shared_cache(frame.x + offset + anchor)),
                       frame.tether_length[v]);
        store_shared_cache(frame.x + offset + v, xi);
      }
    });
  }

  /// Body contact between iterations; after the last one it is part of finish_particle.
  __device__ void touch(int s) const {
    owned([&](int v) {
      const int i = offset + v;
      Vec4<T> xi = load_shared_cache(frame.x + i);
      Vec4<T> si = load_shared_cache(frame.start + i);
      Vec4<T> held = frame.held[i];
      touch_body(frame, i, s, rule.friction, xi, si, held);
      store_shared_cache(frame.x + i, xi);
      store_shared_cache(frame.start + i, si);
      frame.held[i] = held;
    });
  }

  __device__ void finish() const {
    owned([&](int v) {
      const int i = offset + v;
      Vec4<T> xi = load_shared_cache(frame.x + i);
      Vec4<T> si = load_shared_cache(frame.start + i);
      const Vec4<T> v4 = frame.velocity[i];
      Vec3<T> vi = xyz(v4);
      finish_particle(frame, i, frame.substeps - 1, rule.friction, xi, si, vi);
      frame.x[i] = xi;
      frame.velocity[i] = with_w(vi, T(0));
    });
  }
};

/// One frame of every scene: a persistent launch of `blocks` blocks per scene.
template <class T, CudaBarrier kBarrier>
__global__ void __launch_bounds__(kFrameThreads, 1)
    frame_kernel(const CudaFrame<T> frame, int blocks) {
  extern __shared__ __align__(32) unsigned char memory[];
  const BlockWork<T> work(frame, blocks, memory);
  unsigned goal = 0;
  const auto wait = [&] {
    scene_barrier<kBarrier>(frame.arrived + work.scene, goal, static_cast<unsigned>(blocks));
  };
  for (int s = 0; s < frame.substeps; ++s) {
    for (int iteration = 0; iteration < frame.iterations; ++iteration) {
      for (int p = 0; p < frame.phase_count; ++p) {
        work.phase(s, iteration, p);
        wait();
      }
      if (frame.tether_anchor != nullptr) {
        work.tethers();
        wait();
      }
      if (iteration + 1 < frame.iterations && frame.body.face_count > 0) {
        work.touch(s);
        wait();
      }
    }
  }
  work.finish();
}

/// The same, one step per launch: for a CUDA graph, where the graph's edges are the barriers.
enum class FrameStep { Phase, Tethers, Touch, Finish };

template <class T>
__global__ void __launch_bounds__(kFrameThreads, 1)
    frame_step_kernel(const CudaFrame<T> frame, int blocks, FrameStep step, int s, int iteration,
                      int p) {
  extern __shared__ __align__(32) unsigned char memory[];
  const BlockWork<T> work(frame, blocks, memory);
  switch (step) {
    case FrameStep::Phase:
      work.phase(s, iteration, p);
      break;
    case FrameStep::Tethers:
      work.tethers();
      break;
    case FrameStep::Touch:
      work.touch(s);
      break;
    case FrameStep::Finish:
      work.finish();
      break;
  }
}

}  // namespace atelier
