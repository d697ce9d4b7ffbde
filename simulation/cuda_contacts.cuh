#pragma once

#include "simulation/cuda_block.cuh"

namespace atelier {

/// Contact of particle `i` (of all scenes) with the body in the substep [t0, t1].
template <class T>
__device__ inline bool touch_particle(const CudaFrame<T>& frame, const BodyContactRule<T>& rule,
                                      int i, BodyParticle<T>& p, T t0, T t1) {
  if (!(p.x.w > T(0))) {
    return false;
  }
  const BodyOutlook<T> outlook = frame.outlook[i];
  const BodySearch search = body_search(outlook, xyz(p.x), xyz(frame.frame_start[i]),
                                        frame.frame_time * xyz(frame.frame_velocity[i]), t1);
  if (search == BodySearch::Nothing) {
    return false;
  }
  if (search == BodySearch::Candidates) {
    return contact_by_candidates(p, frame.body, t0, t1, rule,
                                 frame.candidates + static_cast<std::int64_t>(i) * kBodyCandidates,
                                 outlook.count);
  }
  return contact_by_tree(p, frame.body, t0, t1, rule, outlook, search);
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
  for (int v = static_cast<int>(threadIdx.x); v < vertex_end - vertex_begin;
       v += static_cast<int>(blockDim.x)) {
    const int i = work.offset + vertex_begin + v;
    BodyParticle<T> p{
        work.x[v], work.start[v], frame.held != nullptr ? frame.held[i] : Vec4<T>{}, {}};
    const bool touches = touch_particle(frame, rule, i, p, t0, t1);
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
