#pragma once

#include "simulation/xpbd/cuda_block.cuh"
#include "simulation/xpbd/cuda_frame_kernels.cuh"
#include "simulation/xpbd/cuda_team.cuh"

namespace atelier {

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

/// How particle `i` (of all scenes) flies through the frame.
template <class T>
__device__ inline FreeFlight<T> free_flight_of(const CudaFrame<T>& frame, int i) {
  return {xyz(frame.frame_start[i]), frame.frame_time * xyz(frame.frame_velocity[i])};
}

/// The body in substep `s`, as it meets this scene.
template <class T>
__device__ inline BodySubstep<T> body_substep(const CudaFrame<T>& frame, int scene, int s) {
  return {frame.body, body_rule_of(frame, scene),
          static_cast<T>(s) / static_cast<T>(frame.substeps),
          static_cast<T>(s + 1) / static_cast<T>(frame.substeps)};
}

/// How particle `i` (of all scenes) finds its contacts in the substep that ends at `t1`.
template <class T>
__device__ inline BodySearch body_search_of(const CudaFrame<T>& frame, int i, const Vec4<T>& x,
                                            T t1) {
  return x.w > T(0) ? body_search(frame.outlook[i], xyz(x), free_flight_of(frame, i), t1)
                    : BodySearch::Nothing;
}

/// Contact of particle `i` with its candidates; `team` looks at them together.
template <class T, class Team>
__device__ inline bool touch_candidates(const CudaFrame<T>& frame, const BodySubstep<T>& step,
                                        int i, BodyParticle<T>& p, const Team& team) {
  BodyOutlook<T> outlook = frame.outlook[i];
  const int* const list = frame.candidates + static_cast<std::int64_t>(i) * kBodyCandidates;
  const auto choose = [&](const Passage<T>& way, bool swept) {
    return team.choose(frame.body, list, outlook.count, way, step.rule.reach, swept);
  };
  const bool touches = contact_by_candidates(p, step, outlook, free_flight_of(frame, i), choose);
  // The outlook is of the impulses, which look further.
  if (!touches && frame.impulses.of == nullptr && team.rank() == 0) {
    frame.outlook[i].gap = outlook.gap;
    frame.outlook[i].from = outlook.from;
  }
  return touches;
}

/// Contact of particle `i` with the body in a substep, by one thread.
template <class T>
__device__ inline bool touch_particle(const CudaFrame<T>& frame, const BodySubstep<T>& step, int i,
                                      BodyParticle<T>& p) {
  const BodySearch search = body_search_of(frame, i, p.x, step.t1);
  if (search == BodySearch::Nothing) {
    return false;
  }
  if (search == BodySearch::Candidates) {
    return touch_candidates(frame, step, i, p, OneThread{});
  }
  return contact_by_tree(p, step, frame.outlook[i], search, AloneInTree{});
}

/// The particles of a scene that may touch the body in a substep, in two lists: those that have
/// candidates, and those that ask the tree. Contacts gather in few places of the cloth, so they are
/// first listed and then shared out among all threads; the order of a list varies, what is done
/// with its items does not depend on it. Passes use the counts of two places by turns.
template <class T>
struct TouchLists {
  int* counts;  ///< [2] of this pass
  int* next;    ///< [2] of the next pass, set to 0 in this one
  int* items;   ///< [2][particles]
  int particles;

  __device__ TouchLists(const CudaFrame<T>& frame, int blocks, int pass) : particles(frame.count) {
    const int scene = static_cast<int>(blockIdx.x) / blocks;
    counts = frame.touch_counts + 4 * scene + 2 * (pass % 2);
    next = frame.touch_counts + 4 * scene + 2 * ((pass + 1) % 2);
    items = frame.touch_items + static_cast<std::int64_t>(scene) * 2 * frame.count;
  }
  __device__ void add(BodySearch search, int k) const {
    if (search != BodySearch::Nothing) {
      const int list = search == BodySearch::Candidates ? 0 : 1;
      items[list * particles + atomicAdd(counts + list, 1)] = k;
    }
  }
  __device__ int count(int list) const { return __ldcg(counts + list); }
  __device__ int item(int list, int at) const { return __ldcg(items + list * particles + at); }
};

/// On-chip memory of this thread's warp for the body, where it has no other.
__device__ inline TeamRoom<32>& own_team_room() {
  __shared__ TeamRoom<32> rooms[kFrameThreads / 32];
  return rooms[threadIdx.x / 32];
}

/// Contact of the particles that the lists of this pass hold. `room`: of this thread's warp.
/// `load(k)` gives the particle, `done(k, p, touches)` takes it back, by one thread. `kBoxes`: see
/// TeamInBody. Not inlined: the sweeps around it then keep their registers.
template <bool kBoxes, class T, class Load, class Done>
__device__ __noinline__ void touch_listed(const CudaFrame<T>& frame, int blocks, int s, int pass,
                                          TeamRoom<32>& room, const Load& load, const Done& done) {
  namespace cg = cooperative_groups;
  const cg::thread_block_tile<32> warp = cg::tiled_partition<32>(cg::this_thread_block());
  const cg::thread_block_tile<kTeam> tile = cg::tiled_partition<kTeam>(warp);
  const TouchLists<T> lists(frame, blocks, pass);
  const int scene = static_cast<int>(blockIdx.x) / blocks;
  const int offset = scene * frame.count;
  const BodySubstep<T> step = body_substep(frame, scene, s);
  const int thread = scene_thread(blocks);
  const int threads = blocks * static_cast<int>(blockDim.x);
  if (thread < 2) {
    lists.next[thread] = 0;
  }
  const int trees = lists.count(1);
  const int candidates = lists.count(0);
  const TeamInBody<32, kBoxes> whole{warp, room};
  for (int at = thread / 32; at < trees; at += threads / 32) {
    const int k = lists.item(1, at);
    BodyParticle<T> p = load(k);
    const BodySearch search = body_search_of(frame, offset + k, p.x, step.t1);
    const bool touches = contact_by_tree(p, step, frame.outlook[offset + k], search, whole);
    if (whole.rank() == 0) {
      done(k, p, touches);
    }
  }
  // From the last warp on: the first ones had the trees.
  const TeamOfChoice team{tile};
  for (int at =
           (threads - 32 - thread / 32 * 32) / kTeam + static_cast<int>(tile.meta_group_rank());
       at < candidates; at += threads / kTeam) {
    const int k = lists.item(0, at);
    BodyParticle<T> p = load(k);
    const bool touches = touch_candidates(frame, step, offset + k, p, team);
    if (team.rank() == 0) {
      done(k, p, touches);
    }
  }
}

/// 1 for a particle that a feature of the body pushed in this iteration, or an impulse in this
/// substep.
template <class T>
__device__ inline int pushed_before(const CudaFrame<T>& frame, int i) {
  if (frame.impulses.of != nullptr) {
    return squared_norm(xyz(frame.impulses.of[i])) > T(0) ? 1 : 0;
  }
  return frame.features.face_count > 0 ? __ldcg(frame.features.pushed + i) : 0;
}

/// Follows the sweep of an iteration of substep `s`: tethers (their anchors are fixed, so
/// nobody moves them here); lists who may touch the body then.
template <class T>
__device__ __noinline__ void hold_and_list(const CudaFrame<T>& frame, int blocks, int s, int pass) {
  const int offset = static_cast<int>(blockIdx.x) / blocks * frame.count;
  const TouchLists<T> lists(frame, blocks, pass);
  const T t1 = static_cast<T>(s + 1) / static_cast<T>(frame.substeps);
  for (int k = scene_thread(blocks); k < frame.count; k += blocks * static_cast<int>(blockDim.x)) {
    const int i = offset + k;
    Vec4<T> x = load_shared_cache(frame.x + i);
    const int anchor = frame.tether_anchor != nullptr ? frame.tether_anchor[k] : -1;
    if (anchor >= 0) {
      project_tether(x, xyz(load_shared_cache(frame.x + offset + anchor)), frame.tether_length[k]);
      store_shared_cache(frame.x + i, x);
    }
    if (frame.body.face_count > 0) {
      lists.add(body_search_of(frame, i, x, t1), k);
      frame.touched[i] = pushed_before(frame, i);
    }
  }
}

template <bool kBoxes, class T>
__device__ inline void touch_body(const CudaFrame<T>& frame, int blocks, int s, int pass) {
  const int offset = static_cast<int>(blockIdx.x) / blocks * frame.count;
  touch_listed<kBoxes>(
      frame, blocks, s, pass, own_team_room(),
      [&](int k) {
        const int i = offset + k;
        return BodyParticle<T>{
            load_shared_cache(frame.x + i),
            load_shared_cache(frame.start + i),
            frame.held != nullptr ? load_shared_cache(frame.held + i) : Vec4<T>{},
            {}};
      },
      [&](int k, const BodyParticle<T>& p, bool touches) {
        const int i = offset + k;
        if (touches) {
          store_shared_cache(frame.x + i, p.x);
          store_shared_cache(frame.start + i, p.start);
          if (frame.held != nullptr) {
            store_shared_cache(frame.held + i, p.held);
          }
          frame.touched[i] = 1;
        }
      });
}

}  // namespace atelier
