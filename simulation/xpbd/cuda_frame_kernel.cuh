#pragma once

#include "simulation/xpbd/cuda_feature_passes.cuh"
#include "simulation/xpbd/cuda_frame_kernels.cuh"
#include "simulation/xpbd/cuda_self_substep.cuh"
#include "simulation/xpbd/cuda_sweep.cuh"

namespace atelier {

/// On-chip memory of where phases begin and end, where plans stay on chip.
__device__ inline Schedule::Phase* phases_on_chip() {
  __shared__ Schedule::Phase phases[kMostResidentPhases];
  return phases;
}

/// One frame of one scene, as one block does it. `kLean`: undamped springs and hinges alone, known
/// to the compiler.
template <class T, FrameKind kKind, bool kLean>
struct FrameWork : BlockWork<T> {
  static constexpr bool kFull = kKind != FrameKind::Plain;
  using BlockWork<T>::frame;
  using BlockWork<T>::scale;
  using BlockWork<T>::scene;
  using BlockWork<T>::block;
  using BlockWork<T>::blocks;
  using BlockWork<T>::offset;
  using BlockWork<T>::x;
  using BlockWork<T>::start;
  using BlockWork<T>::plan_room;
  unsigned char* memory;

  __device__ FrameWork(const CudaFrame<T>& f, int blocks_per_scene, unsigned char* on_chip)
      : BlockWork<T>(f, blocks_per_scene, on_chip), memory(on_chip) {
    if constexpr (kLean) {
      scale.gamma = T(0);  // known to the compiler
    }
  }

  __device__ Schedule::Phase phase_range(int p) const {
    return frame.resident != 0 ? phases_on_chip()[p] : frame.phases[p];
  }

  /// Velocity of particle `i` after a substep.
  __device__ Vec3<T> finished_velocity(int i, const Vec4<T>& xi, const Vec4<T>& si,
                                       Vec3<T> vi) const {
    update_velocity(xi, si, vi, frame.h, frame.keep);
    if (!(isfinite(xi.x) && isfinite(xi.y) && isfinite(xi.z))) {
      atomicMin(frame.bad, i);
    }
    return vi;
  }

  /// Ends the last substep for the particles of a phase-0 patch (if `ends`) and begins substep `s`.
  __device__ void begin(const PlanHeader& patch, int s, bool ends) const {
    const int threads = static_cast<int>(blockDim.x);
    const int first = offset + patch.vertex_begin;
    const T share = T(1) / static_cast<T>(frame.substeps - s);
    for (int v = static_cast<int>(threadIdx.x); v < patch.vertex_count; v += threads) {
      const int i = first + v;
      Vec3<T> vi = xyz(frame.velocity[i]);
      Vec4<T> xi = load_shared_cache(frame.x + i);
      Vec4<T> si{};
      if (ends) {
        si = load_shared_cache(frame.start + i);
        vi = finished_velocity(i, xi, si, vi);
      }
      if (s == 0) {
        frame.frame_start[i] = xi;
        frame.frame_velocity[i] = with_w(vi, T(0));
      }
      Vec3<T> acceleration = frame.gravity;
      if (frame.air != nullptr) {
        acceleration += xyz(frame.air[i]);
      }
      const Vec3<T> target = xi.w > T(0) ? Vec3<T>{} : xyz(frame.target[i]);
      predict(xi, si, vi, ParticleDrive<T>{acceleration, target}, share, frame.h);
      x[v] = xi;
      if (frame.keeps_starts != 0) {
        start[v] = si;
      }
      store_shared_cache(frame.start + i, si);
      frame.velocity[i] = with_w(vi, T(0));
      if (kFull && frame.held != nullptr) {
        store_shared_cache(frame.held + i, Vec4<T>{});
      }
      if constexpr (has_self(kKind)) {
        store_shared_cache(frame.self.origin + i, si);
        store_shared_cache(frame.self.carry + i, Vec4<T>{});
      }
    }
  }

  /// Brings the plans of everything that the block works on on chip, in the order in which it
  /// comes.
  __device__ void load_all_plans() const {
    unsigned char* at = plan_room;
    for (int p = 0; p < frame.phase_count; ++p) {
      const Schedule::Phase range = frame.phases[p];
      if (threadIdx.x == 0) {
        phases_on_chip()[p] = range;
      }
      for (int k = range.patch_begin + block; k < range.patch_end; k += blocks) {
        at += load_plan(frame, frame.patches[k], at);
      }
    }
    wait_for_plans();
  }

  /// One phase of one iteration; `at` walks over the resident plans. In the first phase of the
  /// first iteration the owner also ends the last substep and begins this one.
  __device__ void phase(int s, int iteration, int p, unsigned char*& at) const {
    const int tid = static_cast<int>(threadIdx.x);
    const int threads = static_cast<int>(blockDim.x);
    const bool begins = p == 0 && iteration == 0;
    const Schedule::Phase range = phase_range(p);
    EdgeMultipliers<T>* const lambda = this->lambda();
    for (int k = range.patch_begin + block; k < range.patch_end; k += blocks) {
      if (frame.resident == 0) {
        at = plan_room;
        load_plan(frame, frame.patches[k], at);
        wait_for_plans();
      }
      if (begins && s == frame.first_substep && block == 0) {
        clear_touches();
      }
      const Plan<T> plan(at, frame.records_on_chip != 0);
      const PlanHeader header = *plan.header;
      const EdgeSource<T> source(frame, plan, header, iteration == 0 ? nullptr : lambda);
      const EdgeItem<T> first =
          source.fetch(plan.colours[0].edge_begin, plan.colours[1].edge_begin);
      if (begins) {
        begin(header, s, s > frame.first_substep);
      } else {
        for (int v = tid; v < header.vertex_count; v += threads) {
          const int i = offset + plan.particles[v];
          x[v] = load_shared_cache(frame.x + i);
          if (!kLean && frame.damping > T(0)) {
            start[v] = load_shared_cache(frame.start + i);
          }
        }
      }
      __syncthreads();
      const SweptPatch<T> patch{plan.colours,          header.colour_count, x, start, lambda,
                                this->strain_lambda(), iteration == 0};
      sweep_patch<T, !kLean>(frame, patch, source, first, scale);
      for (int v = tid; v < header.vertex_count; v += threads) {
        store_shared_cache(frame.x + offset + plan.particles[v], x[v]);
      }
      __syncthreads();
      at += header.bytes;
    }
  }

  /// Empties the lists of who may touch the body, at the start of a launch.
  __device__ void clear_touches() const {
    if (kFull && threadIdx.x < 4 && frame.body.face_count > 0) {
      frame.touch_counts[4 * scene + static_cast<int>(threadIdx.x)] = 0;
    }
  }

  /// Begins substep `s` without a sweep.
  __device__ void begin_only(int s) const {
    if (s == frame.first_substep && block == 0) {
      clear_touches();
    }
    const Schedule::Phase range = frame.phases[0];
    for (int k = range.patch_begin + block; k < range.patch_end; k += blocks) {
      const Schedule::Patch patch = frame.patches[k];
      PlanHeader header{};
      header.vertex_begin = patch.vertex_begin;
      header.vertex_count = patch.vertex_end - patch.vertex_begin;
      begin(header, s, s > frame.first_substep);
      for (int v = static_cast<int>(threadIdx.x); v < header.vertex_count;
           v += static_cast<int>(blockDim.x)) {
        store_shared_cache(frame.x + offset + header.vertex_begin + v, x[v]);
      }
      __syncthreads();
    }
  }

  __device__ void finish() const {
    this->owned_patches([&](const Schedule::Patch& patch) {
      const int count = patch.vertex_end - patch.vertex_begin;
      for (int v = static_cast<int>(threadIdx.x); v < count; v += static_cast<int>(blockDim.x)) {
        const int i = offset + patch.vertex_begin + v;
        const Vec4<T> si = frame.keeps_starts != 0 ? start[v] : load_shared_cache(frame.start + i);
        const Vec3<T> vi = finished_velocity(i, x[v], si, xyz(frame.velocity[i]));
        frame.x[i] = x[v];
        frame.velocity[i] = with_w(vi, T(0));
      }
    });
  }
};

/// A phase beside contacts, in a function of its own so that it keeps its registers. Returns where
/// the next resident plan is.
template <class T, FrameKind kKind, bool kLean>
__device__ __noinline__ unsigned char* sweep_phase(const FrameWork<T, kKind, kLean>& work, int s,
                                                   int iteration, int p, unsigned char* at) {
  work.phase(s, iteration, p, at);
  return at;
}

/// One frame of every scene: a persistent launch of `blocks` blocks per scene.
template <class T, CudaBarrier kBarrier, FrameKind kKind>
__global__ void __launch_bounds__(frame_threads(kKind), 1)
    frame_kernel(const __grid_constant__ CudaFrame<T> frame, int blocks) {
  extern __shared__ __align__(32) unsigned char memory[];
  // Where other scenes fill the waits, one way for all that a sweep may hold gets more done.
  constexpr bool kOneWay = kKind == FrameKind::Full && kBarrier == CudaBarrier::Block;
  const FrameWork<T, kKind, !kOneWay> work(frame, blocks, memory);
  [[maybe_unused]] const bool lean = !(frame.damping > T(0)) && frame.strain_count == 0;
  unsigned* const arrived = frame.arrived + 2 * work.scene;
  unsigned goal = 0;
  [[maybe_unused]] SelfClock clock;
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  [[maybe_unused]] const auto sweep_any = [](const CudaFrame<T>& f, int n, unsigned char* on_chip,
                                             int s, int iteration, int p, unsigned char* at) {
    return sweep_phase(FrameWork<T, kKind, false>(f, n, on_chip), s, iteration, p, at);
  };
  if (frame.resident != 0) {
    work.load_all_plans();
  }
  for (int s = frame.first_substep; s < frame.last_substep; ++s) {
    for (int iteration = 0; iteration < frame.iterations; ++iteration) {
      unsigned char* at = work.plan_room;
      for (int p = 0; p < frame.phase_count; ++p) {
        if constexpr (kKind == FrameKind::Plain || kOneWay) {
          work.phase(s, iteration, p, at);
        } else if constexpr (has_self(kKind)) {
          at = lean ? sweep_phase(work, s, iteration, p, at)
                    : sweep_any(frame, blocks, memory, s, iteration, p, at);
        } else if (lean) {
          work.phase(s, iteration, p, at);
        } else {
          at = sweep_any(frame, blocks, memory, s, iteration, p, at);
        }
        wait();
      }
      const bool again = iteration + 1 < frame.iterations;
      if constexpr (kKind != FrameKind::Plain && !has_self(kKind)) {
        push_off_features(frame, blocks, s, iteration, own_team_room(), wait);
        const int pass = s * frame.iterations + iteration;
        if (frame.tether_anchor != nullptr || frame.body.face_count > 0) {
          hold_and_list(frame, blocks, s, pass);
          wait();
        }
        if (frame.body.face_count > 0) {
          touch_body<kBarrier != CudaBarrier::Block>(frame, blocks, s, pass);
          wait();
        }
      }
      if constexpr (has_self(kKind)) {
        push_off_features(frame, blocks, s, iteration, own_warp_room<T>().body, wait);
        // Cloth that lies on the body has to be known before cloth pushes cloth. In the end nothing
        // passes, neither cloth nor body; where both cannot be, the body wins.
        touch_before_pairs<T, kBarrier>(frame, blocks, s, iteration, clock, arrived, goal);
        if (push_apart_all<T, kBarrier>(frame, blocks, s, s + 1 == frame.substeps && !again, clock,
                                        arrived, goal)) {
          keep_all_back<T, kBarrier, SelfKeeps>(frame, blocks, s, clock, arrived, goal);
        }
      }
    }
  }
  work.finish();
  leave_scene<kBarrier>(arrived, static_cast<unsigned>(blocks));
}

template <class T>
__global__ void __launch_bounds__(kFrameThreads, 1)
    frame_step_kernel(const __grid_constant__ CudaFrame<T> frame, int blocks, FrameStep step, int s,
                      int iteration, int p) {
  extern __shared__ __align__(32) unsigned char memory[];
  const FrameWork<T, FrameKind::Full, false> work(frame, blocks, memory);
  switch (step) {
    case FrameStep::Begin:
      work.begin_only(s);
      break;
    case FrameStep::Phase: {
      unsigned char* at = work.plan_room;
      work.phase(s, iteration, p, at);
      break;
    }
    case FrameStep::PushFeatures:
      if (features_push(frame, blocks, s, iteration, p)) {
        push_features(frame, blocks, s, iteration, p, own_team_room());
      }
      break;
    case FrameStep::TakeFeatures:
      take_features(frame, blocks);
      break;
    case FrameStep::Hold:
      hold_and_list(frame, blocks, s, s * frame.iterations + iteration);
      break;
    case FrameStep::Touch:
      touch_body<false>(frame, blocks, s, s * frame.iterations + iteration);
      break;
    case FrameStep::Finish:
      work.finish();
      break;
  }
}

template <class T, FrameKind kKind, CudaBarrier kBarrier>
FrameKernel<T> frame_kernel_of() {
  return frame_kernel<T, kBarrier, kKind>;
}

template <class T>
FrameStepKernel<T> frame_step_kernel_of() {
  return frame_step_kernel<T>;
}

}  // namespace atelier
