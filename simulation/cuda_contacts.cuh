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

/// Body contacts of the particles on chip at the end of an iteration of substep `s`. Not inlined:
/// the sweeps around it then keep their registers.
template <class T>
__device__ __noinline__ void touch_body(const CudaFrame<T>& frame, int blocks,
                                        unsigned char* memory, int vertex_begin, int vertex_end,
                                        int s) {
  if (frame.body.face_count == 0) {
    return;
  }
  const BlockWork<T> work(frame, blocks, memory);
  const BodyContactRule<T> rule = body_rule_of(frame, work.scene);
  const T t0 = static_cast<T>(s) / static_cast<T>(frame.substeps);
  const T t1 = static_cast<T>(s + 1) / static_cast<T>(frame.substeps);
  // Whole warps, whose threads look for contacts together.
  const int count = vertex_end - vertex_begin;
  for (int v = static_cast<int>(threadIdx.x); v < (count + 31) / 32 * 32;
       v += static_cast<int>(blockDim.x)) {
    const bool there = v < count;
    const int i = work.offset + vertex_begin + v;
    BodyParticle<T> p{};
    if (there) {
      p = {work.x[v], work.start[v], frame.held != nullptr ? frame.held[i] : Vec4<T>{}, {}};
    }
    const bool touches = touch_particle(frame, rule, there, i, p, t0, t1);
    if (!there) {
      continue;
    }
    if (touches) {
      work.x[v] = p.x;
      work.start[v] = p.start;
      if (frame.held != nullptr) {
        frame.held[i] = p.held;
      }
    }
    frame.touched[i] = touches ? 1 : 0;
  }
}

}  // namespace atelier
