#pragma once

#include "simulation/cuda_block.cuh"
#include "simulation/cuda_team.cuh"

namespace atelier {

/// Contact of particle `i` (of all scenes), where it `asks`, with the body in the substep [t0, t1].
/// All threads of the warp call it together.
template <class T>
__device__ inline bool touch_particle(const CudaFrame<T>& frame, const BodyContactRule<T>& rule,
                                      bool asks, int i, BodyParticle<T>& p, T t0, T t1) {
  BodyOutlook<T> outlook{};
  BodySearch search = BodySearch::Nothing;
  Vec3<T> frame_start{};
  Vec3<T> flight{};
  if (asks && p.x.w > T(0)) {
    outlook = frame.outlook[i];
    frame_start = xyz(frame.frame_start[i]);
    flight = frame.frame_time * xyz(frame.frame_velocity[i]);
    search = body_search(outlook, xyz(p.x), frame_start, flight, t1);
  }
  bool touches = false;
  if (search != BodySearch::Nothing && search != BodySearch::Candidates) {
    touches = contact_by_tree(p, frame.body, t0, t1, rule, outlook, search);
  }
  __syncwarp();
  const bool by_candidates = search == BodySearch::Candidates;
  if (!__any_sync(0xFFFFFFFFu, by_candidates)) {
    return touches;
  }
  const int* const list = frame.candidates + static_cast<std::int64_t>(i) * kBodyCandidates;
  const auto choose = [&](bool some, bool swept) {
    return choose_together(frame.body, some, list, outlook.count, xyz(p.start), xyz(p.x), t0, t1,
                           rule.reach, swept);
  };
  const FaceChoice<T> choice = choose(by_candidates, true);
  bool meets = false;
  if (by_candidates) {
    meets = touch_choice(p, frame.body, t0, t1, rule, choice);
    if (!meets) {
      look_out_again(outlook, choice.nearest, xyz(p.x), frame_start, flight, t1, rule);
      frame.outlook[i].gap = outlook.gap;
      frame.outlook[i].from = outlook.from;
    }
  }
  __syncwarp();
  if (__any_sync(0xFFFFFFFFu, meets)) {
    const FaceChoice<T> again = choose(meets, false);
    if (meets) {
      touch_again(p, frame.body, t0, t1, rule, again.nearest);
    }
  }
  return touches || meets;
}

template <class T>
__device__ inline BodyContactRule<T> body_rule_of(const CudaFrame<T>& frame, int scene) {
  BodyContactRule<T> rule = frame.body_rule;
  rule.friction = frame.rules[scene].friction;
  return rule;
}

/// Number of this thread among those of its scene: neighbouring warps in different blocks, so that
/// work that gathers in one place of the cloth is spread over all of them.
__device__ inline int scene_thread(int blocks) {
  const int block = static_cast<int>(blockIdx.x) % blocks;
  const int warp = static_cast<int>(threadIdx.x) / 32;
  return (warp * blocks + block) * 32 + static_cast<int>(threadIdx.x) % 32;
}

/// What follows the sweep of an iteration of substep `s`: tethers (their anchors are fixed, so
/// nobody moves them here), then contact with the body. Not inlined: the sweeps around it then keep
/// their registers.
template <class T>
__device__ __noinline__ void hold_and_touch(const CudaFrame<T>& frame, int blocks, int s) {
  const int scene = static_cast<int>(blockIdx.x) / blocks;
  const int offset = scene * frame.count;
  const BodyContactRule<T> rule = body_rule_of(frame, scene);
  const T t0 = static_cast<T>(s) / static_cast<T>(frame.substeps);
  const T t1 = static_cast<T>(s + 1) / static_cast<T>(frame.substeps);
  // Whole warps, whose threads look for contacts together.
  for (int k = scene_thread(blocks); k < (frame.count + 31) / 32 * 32;
       k += blocks * static_cast<int>(blockDim.x)) {
    const bool there = k < frame.count;
    const int i = offset + k;
    BodyParticle<T> p{};
    bool held = false;
    if (there) {
      p.x = load_shared_cache(frame.x + i);
      const int anchor = frame.tether_anchor != nullptr ? frame.tether_anchor[k] : -1;
      held = anchor >= 0;
      if (held) {
        project_tether(p.x, xyz(load_shared_cache(frame.x + offset + anchor)),
                       frame.tether_length[k]);
      }
    }
    bool touches = false;
    if (frame.body.face_count > 0) {
      if (there) {
        p.start = load_shared_cache(frame.start + i);
        p.held = frame.held != nullptr ? load_shared_cache(frame.held + i) : Vec4<T>{};
      }
      touches = touch_particle(frame, rule, there, i, p, t0, t1);
      if (touches) {
        store_shared_cache(frame.start + i, p.start);
        if (frame.held != nullptr) {
          store_shared_cache(frame.held + i, p.held);
        }
      }
      if (there) {
        frame.touched[i] = touches ? 1 : 0;
      }
    }
    if (touches || held) {
      store_shared_cache(frame.x + i, p.x);
    }
  }
}

}  // namespace atelier
