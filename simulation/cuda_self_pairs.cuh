#pragma once

#include <cooperative_groups.h>

#include "simulation/cuda_contacts.cuh"
#include "simulation/cuda_refit.cuh"

namespace atelier {

/// How far the contacts of a scene with itself are: the same numbers in each of its blocks.
struct SelfClock {
  int age = -1;    ///< substeps since the search for pairs, this one included; -1: none
  int ahead = 1;   ///< substeps that the search looked ahead
  int serial = 0;  ///< of the pass
};

/// Appends to a list that many threads write; what is beyond `room` is counted alone.
template <class Item>
__device__ inline void append(Item* list, int* count, int room, const Item& item) {
  const cooperative_groups::coalesced_group group = cooperative_groups::coalesced_threads();
  int first = 0;
  if (group.thread_rank() == 0) {
    first = atomicAdd(count, static_cast<int>(group.size()));
  }
  const int at = group.shfl(first, 0) + static_cast<int>(group.thread_rank());
  if (at < room) {
    list[at] = item;
  }
}

template <class T>
__device__ inline void widen(PushExtent& extent, Vec3<T> push) {
  const int units[3] = {to_units(push.x), to_units(push.y), to_units(push.z)};
#pragma unroll
  for (int k = 0; k < 3; ++k) {
    if (units[k] > 0) {
      atomicMax(&extent.high[k], units[k]);
    } else if (units[k] < 0) {
      atomicMin(&extent.low[k], units[k]);
    }
  }
}

/// The contacts of one scene with itself (see self_contact_math.h), as all threads of its blocks
/// share them out.
template <class T>
struct SelfWork {
  const CudaFrame<T>& frame;
  SelfView<T> cloth;
  SelfCounts* counts;
  Vec4<T>* x;
  Vec4<T>* start;
  PushSum* sums;
  Vec4<T>* calm;
  int* support;
  const int* touched;  ///< null: no body
  SelfPair<T>* face_pairs;
  SelfPair<T>* edge_pairs;
  int2* crossings;
  int scene, thread, threads;

  __device__ SelfWork(const CudaFrame<T>& f, int blocks)
      : frame(f), cloth(f.self.cloth), scene(static_cast<int>(blockIdx.x) / blocks) {
    const CudaSelfFrame<T>& s = f.self;
    const std::int64_t n = static_cast<std::int64_t>(scene) * f.count;
    cloth.surface.start += n;
    cloth.surface.end += n;
    cloth.surface.nodes += static_cast<std::int64_t>(scene) * s.inner;
    cloth.tangled += n;
    counts = s.counts + scene;
    x = f.x + n;
    start = f.start + n;
    sums = s.sums + n;
    calm = s.calm + n;
    support = s.support + n;
    touched = f.body.face_count > 0 ? f.touched + n : nullptr;
    face_pairs = s.face_pairs + static_cast<std::int64_t>(scene) * s.room;
    edge_pairs = s.edge_pairs + static_cast<std::int64_t>(scene) * s.edge_room();
    crossings = s.crossings + static_cast<std::int64_t>(scene) * s.crossing_room();
    const int block = static_cast<int>(blockIdx.x) % blocks;
    thread = block * static_cast<int>(blockDim.x) + static_cast<int>(threadIdx.x);
    threads = blocks * static_cast<int>(blockDim.x);
  }

  __device__ Vec4<T> load(int i) const { return load_shared_cache(x + i); }
  __device__ Vec4<T> load_start(int i) const { return load_shared_cache(start + i); }

  /// Level of a particle that lies on the body, or what its contacts gave it.
  __device__ int supported(int i, int given) const {
    return touched != nullptr && __ldcg(touched + i) != 0 ? kSupportLevels : given;
  }

  /// Asks for a new search where a particle left its flight.
  __device__ void watch(int i, Vec3<T> xi, const SelfClock& clock) const {
    if (clock.age >= 0 &&
        left_flight(cloth, i, xi, static_cast<T>(clock.age) / static_cast<T>(clock.ahead),
                    frame.self.rule)) {
      atomicMax(&counts->stale, clock.serial);
    }
  }

  /// Where the particles are and where they fly.
  __device__ void begin_search(const SelfClock& clock) const {
    Vec4<T>* const from = frame.self.start + static_cast<std::int64_t>(scene) * frame.count;
    Vec4<T>* const to = frame.self.end + static_cast<std::int64_t>(scene) * frame.count;
    int* const tangled = frame.self.tangled + static_cast<std::int64_t>(scene) * frame.count;
    for (int i = thread; i < frame.count; i += threads) {
      const Vec4<T> xi = load(i);
      const Vec4<T> si = load_start(i);
      from[i] = si;
      to[i] = with_w(xyz(si) + static_cast<T>(clock.ahead) * (xyz(xi) - xyz(si)), xi.w);
      tangled[i] = 0;
    }
    if (thread == 0) {
      counts->face_pairs = 0;
      counts->edge_pairs = 0;
      counts->crossings = 0;
      ++counts->searches;
    }
  }
  __device__ void refit() const {
    BoxNode<T>* const nodes =
        frame.self.nodes + static_cast<std::int64_t>(scene) * frame.self.inner;
    unsigned* const arrivals =
        frame.self.arrivals + static_cast<std::int64_t>(scene) * frame.self.inner;
    for (int f = thread; f < cloth.surface.face_count; f += threads) {
      refit_from_face(cloth.surface, f, nodes, frame.self.node_parent, frame.self.leaf_parent,
                      arrivals);
    }
  }
  __device__ void collect() const {
    const CudaSelfFrame<T>& s = frame.self;
    int* const tangled = s.tangled + static_cast<std::int64_t>(scene) * frame.count;
    for (int k = thread; k < frame.count + cloth.edge_count; k += threads) {
      if (k < frame.count) {
        collect_faces(cloth, k, s.rule, [&](const SelfPair<T>& pair) {
          append(face_pairs, &counts->face_pairs, s.room, pair);
        });
        continue;
      }
      const int e = k - frame.count;
      int found = 0;
      collect_edges(
          cloth, e, s.rule,
          [&](const SelfPair<T>& pair) {
            append(edge_pairs, &counts->edge_pairs, s.edge_room(), pair);
          },
          [&](int face) {
            if (found++ < kSelfCrossings) {
              append(crossings, &counts->crossings, s.crossing_room(), make_int2(e, face));
              const FaceIndices f = cloth.surface.faces[face];
              const ClothEdge edge = cloth.edges[e];
              // Every writer writes the same.
              atomicExch(&tangled[edge.a], 1);
              atomicExch(&tangled[edge.b], 1);
              atomicExch(&tangled[f.a], 1);
              atomicExch(&tangled[f.b], 1);
              atomicExch(&tangled[f.c], 1);
            }
          });
    }
  }
  /// Remembers how much room the lists would have needed.
  __device__ void end_search() const {
    if (thread == 0) {
      counts->most = max(
          counts->most,
          CudaSelfFrame<T>::room_for(counts->face_pairs, counts->edge_pairs, counts->crossings));
    }
  }

  __device__ void push_pairs(int pass, const SelfClock& clock, bool counted) const {
    SelfRule<T> rule = frame.self.rule;
    if (pass > 0) {  // old overlaps and crossings are worked at once a substep
      rule.old_overlap = T(0);
      rule.untangle = T(0);
    }
    const auto load_x = [&](int i) { return load(i); };
    const auto load_s = [&](int i) { return load_start(i); };
    const auto level = [&](int i) { return __ldcg(support + i); };
    const auto add = [&](int i, Vec3<T> fresh, Vec3<T> off, int given) {
      PushSum* const sum = sums + i;
      __stcg(&sum->used, 1);
      widen(sum->fresh, fresh);
      widen(sum->calm, off);
      if (given > 0) {
        atomicMax(&sum->support, given);
      }
    };
    const auto stay = [&](int i) {
      __stcg(&sums[i].used, 1);
      __stcg(&sums[i].stay, 1);
    };
    const CudaSelfFrame<T>& s = frame.self;
    const int faces = min(__ldcg(&counts->face_pairs), s.room);
    const int edges = min(__ldcg(&counts->edge_pairs), s.edge_room());
    const int crossed = min(__ldcg(&counts->crossings), s.crossing_room());
    const bool pushes = pass < kSelfPushes;
    int active = 0;
    bool presses = false;
    for (int k = thread; k < faces + edges + crossed; k += threads) {
      PairState state = PairState::Apart;
      if (k < faces) {
        const SelfPair<T> pair = face_pairs[k];
        state = pushes ? push_vertex_face(cloth, pair, rule, load_x, load_s, level, add)
                       : keep_back(cloth, pair, false, load_x, load_s, stay);
      } else if (k < faces + edges) {
        const SelfPair<T> pair = edge_pairs[k - faces];
        state = pushes ? push_edge_edge(cloth, pair, rule, load_x, load_s, level, add)
                       : keep_back(cloth, pair, true, load_x, load_s, stay);
      } else if (pushes) {
        const int2 c = crossings[k - faces - edges];
        state =
            pull_out(cloth, c.x, c.y, rule, load_x, add) ? PairState::Touches : PairState::Apart;
      }
      active += state != PairState::Apart ? 1 : 0;
      presses = presses || state == PairState::Presses;
    }
    if (presses) {
      atomicMax(&counts->pressed, clock.serial);
    }
    if (counted && pass == 0 && active > 0) {
      atomicAdd(&counts->pushes, active);
    }
  }

  /// Gives every particle what pairs wanted of it, and watches its flight.
  __device__ void apply(const SelfClock& clock) const {
    for (int i = thread; i < frame.count; i += threads) {
      int given = 0;
      if (__ldcg(&sums[i].used) != 0) {
        const PushSum sum = load_sum(sums + i);
        given = sum.support;
        Vec4<T> xi = load(i);
        Vec4<T> off = load_shared_cache(calm + i);
        take_push(sum, xi, load_start(i), off);
        store_shared_cache(x + i, xi);
        store_shared_cache(calm + i, off);
        clear_sum(sums + i, 1);
        watch(i, xyz(xi), clock);
      }
      __stcg(support + i, supported(i, given));
    }
  }
};

/// Touches the body and gets ready for the passes: all blocks of the scene share the particles out,
/// a warp takes 32 and works on one after the other.
template <class T>
__device__ __noinline__ void touch_before_pairs(const CudaFrame<T>& frame, int blocks, int s,
                                                bool first, SelfClock& clock) {
  const SelfWork<T> work(frame, blocks);
  ++clock.serial;
  if (first && clock.age >= 0 && ++clock.age > clock.ahead) {
    clock.age = -1;
  }
  BodyContactRule<T> rule = frame.body_rule;
  rule.friction = frame.rules[work.scene].friction;
  const int offset = work.scene * frame.count;
  const T t0 = static_cast<T>(s) / static_cast<T>(frame.substeps);
  const T t1 = static_cast<T>(s + 1) / static_cast<T>(frame.substeps);
  const int lane = static_cast<int>(threadIdx.x) % 32;
  for (int base = work.thread - lane; base < frame.count; base += work.threads) {
    const int i = base + lane;
    const bool mine = i < frame.count;
    const int at = offset + min(i, frame.count - 1);
    Vec4<T> xi = load_shared_cache(frame.x + at);
    bool touches = false;
    if (frame.body.face_count > 0) {
      Vec4<T> si = load_shared_cache(frame.start + at);
      Vec4<T> held = frame.held[at];
      const BodySearch search =
          mine && xi.w > T(0) ? search_of(frame, at, xi, t1) : BodySearch::Nothing;
      if (search != BodySearch::Nothing && search != BodySearch::Candidates) {
        touches =
            contact_by_tree(xi, si, held, frame.body, t0, t1, rule, frame.outlook[at], search);
      }
      __syncwarp();
      unsigned left = __ballot_sync(kWholeWarp, search == BodySearch::Candidates);
      while (left != 0) {
        const int turn = __ffs(static_cast<int>(left)) - 1;
        left &= left - 1;
        const auto of_turn = [&](const Vec4<T>& v) {
          return with_w(from_lane(xyz(v), turn), __shfl_sync(kWholeWarp, v.w, turn));
        };
        const int j = __shfl_sync(kWholeWarp, at, turn);
        Vec4<T> xj = of_turn(xi);
        Vec4<T> sj = of_turn(si);
        Vec4<T> hj = of_turn(held);
        const int face =
            lane < frame.outlook[j].count
                ? frame.candidates[static_cast<std::int64_t>(j) * kBodyCandidates + lane]
                : -1;
        const bool hit = contact_by_warp(xj, sj, hj, frame.body, t0, t1, rule, face);
        if (lane == turn) {
          xi = xj;
          si = sj;
          held = hj;
          touches = hit;
        }
        __syncwarp();
      }
      if (mine) {
        if (touches) {
          store_shared_cache(frame.x + at, xi);
          store_shared_cache(frame.start + at, si);
          frame.held[at] = held;
        }
        __stcg(frame.touched + at, touches ? 1 : 0);
      }
    }
    if (mine) {
      const int before = s == 0 && first ? 0 : work.support[i];
      __stcg(work.support + i, touches ? kSupportLevels : before);
      store_shared_cache(work.calm + i, Vec4<T>{});
      work.watch(i, xyz(xi), clock);
    }
  }
}

/// Pushes pairs apart until none is pressed. The last pushes are taken up when the substep ends
/// (see BlockWork::settle).
template <class T, CudaBarrier kBarrier>
__device__ __noinline__ void push_apart_all(const CudaFrame<T>& frame, int blocks, int s,
                                            bool counted, SelfClock& clock, unsigned* arrived,
                                            unsigned& goal) {
  const SelfWork<T> work(frame, blocks);
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  for (int pass = 0; pass < kSelfPasses; ++pass) {
    if (clock.age < 0 || __ldcg(&work.counts->stale) == clock.serial) {
      clock.age = 1;
      clock.ahead = min(frame.self.rule.horizon, frame.substeps - s);
      work.begin_search(clock);
      wait();
      work.refit();
      wait();
      work.collect();
      wait();
      work.end_search();
    }
    work.push_pairs(pass, clock, counted);
    wait();
    if (__ldcg(&work.counts->pressed) != clock.serial) {
      return;
    }
    ++clock.serial;
    work.apply(clock);
    wait();
  }
}

}  // namespace atelier
