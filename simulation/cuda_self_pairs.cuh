#pragma once

#include "simulation/cuda_self_search.cuh"

namespace atelier {

/// PushSum::used, 0 before: a pair wants something of the particle, or did in this substep.
constexpr int kPushed = 1;
constexpr int kWasPushed = 2;

/// How far the contacts of a scene with itself are: the same numbers in each of its blocks.
struct SelfClock {
  int age = -1;    ///< substeps since the search for pairs, this one included; -1: none
  int ahead = 1;   ///< substeps that the search looked ahead
  int serial = 0;  ///< of the pass
};

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
  Vec4<T>* origin;
  Vec4<T>* carry;
  PushSum* sums;
  int* support;
  int* touched;  ///< null: no body
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
    cloth.tangled += n;
    cloth.slack += n;
    counts = s.counts + scene;
    x = f.x + n;
    start = f.start + n;
    origin = s.origin + n;
    carry = s.carry + n;
    sums = s.sums + n;
    support = s.support + n;
    touched = f.body.face_count > 0 ? f.touched + n : nullptr;
    face_pairs = s.face_pairs + static_cast<std::int64_t>(scene) * s.room;
    edge_pairs = s.edge_pairs + static_cast<std::int64_t>(scene) * s.edge_room();
    crossings = s.crossings + static_cast<std::int64_t>(scene) * s.crossing_room();
    thread = scene_thread(blocks);
    threads = blocks * static_cast<int>(blockDim.x);
  }

  __device__ Vec4<T> load(int i) const { return load_shared_cache(x + i); }
  __device__ Vec4<T> load_origin(int i) const { return load_shared_cache(origin + i); }
  __device__ Vec4<T> load_carry(int i) const { return load_shared_cache(carry + i); }
  __device__ SelfParticle<T> load_particle(int i) const {
    return {load(i), load_shared_cache(start + i), load_carry(i)};
  }
  __device__ void store(int i, const SelfParticle<T>& p) const {
    store_shared_cache(x + i, p.x);
    store_shared_cache(start + i, p.start);
    store_shared_cache(carry + i, p.carry);
  }

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

  /// More slack until the frame ends for who left its flight, or is about to, so that one pinched
  /// vertex does not make a search in every substep. `clock` is that of the list that no longer
  /// holds.
  __device__ void give_slack(const SelfClock& clock) const {
    T* const slack = frame.self.slack + static_cast<std::int64_t>(scene) * frame.count;
    const T age = static_cast<T>(clock.age) / static_cast<T>(clock.ahead);
    for (int i = thread; clock.age >= 0 && i < frame.count; i += threads) {
      const Vec3<T> away = xyz(load(i)) - xyz(cloth.surface.start[i]) - age * flight(cloth, i);
      slack[i] = max_of(slack[i], T(2) * norm(away));
    }
  }

  /// Where the particles are and where they fly.
  __device__ void begin_search(const SelfClock& clock) const {
    Vec4<T>* const from = frame.self.start + static_cast<std::int64_t>(scene) * frame.count;
    Vec4<T>* const to = frame.self.end + static_cast<std::int64_t>(scene) * frame.count;
    int* const tangled = frame.self.tangled + static_cast<std::int64_t>(scene) * frame.count;
    for (int i = thread; i < frame.count; i += threads) {
      const Vec4<T> xi = load(i);
      const Vec4<T> si = load_origin(i);
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
  /// Fills the lists. `items`: on-chip room of this thread's warp.
  __device__ void collect(const SelfSearch<T>& search, int2* items) const {
    const CudaSelfFrame<T>& s = frame.self;
    int* const tangled = s.tangled + static_cast<std::int64_t>(scene) * frame.count;
    const int lane = search.warp.lane;
    search.look(
        items,
        [&](bool has, const SelfPair<T>& pair) {
          append_in_warp(edge_pairs, &counts->edge_pairs, s.edge_room(), has, pair, lane);
        },
        [&](bool has, const SelfPair<T>& pair) {
          append_in_warp(face_pairs, &counts->face_pairs, s.room, has, pair, lane);
        },
        [&](bool has, int e, int face) {
          append_in_warp(crossings, &counts->crossings, s.crossing_room(), has, make_int2(e, face),
                         lane);
          if (has) {
            const FaceIndices f = cloth.surface.faces[face];
            const ClothEdge edge = cloth.edges[e];
            // Every writer writes the same.
            atomicExch(&tangled[edge.a], 1);
            atomicExch(&tangled[edge.b], 1);
            atomicExch(&tangled[f.a], 1);
            atomicExch(&tangled[f.b], 1);
            atomicExch(&tangled[f.c], 1);
          }
          __syncwarp();
        });
  }
  /// Remembers how much room the lists would have needed.
  __device__ void end_search() const {
    if (thread == 0) {
      counts->most = max(
          counts->most,
          CudaSelfFrame<T>::room_for(counts->face_pairs, counts->edge_pairs, counts->crossings));
    }
  }

  /// Calls `work(pair, edges)` for the pairs of the list that are this thread's.
  template <class Work>
  __device__ void visit_pairs(const Work& work) const {
    const CudaSelfFrame<T>& s = frame.self;
    const int faces = min(__ldcg(&counts->face_pairs), s.room);
    const int edges = min(__ldcg(&counts->edge_pairs), s.edge_room());
    for (int k = thread; k < faces + edges; k += threads) {
      work(k < faces ? face_pairs[k] : edge_pairs[k - faces], k >= faces);
    }
  }

  __device__ void push_pairs(int pass, const SelfClock& clock, bool counted) const {
    SelfRule<T> rule = frame.self.rule;
    if (pass > 0) {  // old overlaps and crossings are worked at once a substep
      rule.old_overlap = T(0);
      rule.untangle = T(0);
    }
    const auto load_x = [&](int i) { return load(i); };
    const auto load_o = [&](int i) { return load_origin(i); };
    const auto level = [&](int i) { return __ldcg(support + i); };
    const auto add = [&](int i, Vec3<T> fresh, Vec3<T> off, int given) {
      PushSum* const sum = sums + i;
      __stcg(&sum->used, kPushed);
      widen(sum->fresh, fresh);
      widen(sum->calm, off);
      if (given > 0) {
        atomicMax(&sum->support, given);
      }
    };
    int active = 0;
    bool presses = false;
    visit_pairs([&](const SelfPair<T>& pair, bool edges) {
      const PairState state = edges
                                  ? push_edge_edge(cloth, pair, rule, load_x, load_o, level, add)
                                  : push_vertex_face(cloth, pair, rule, load_x, load_o, level, add);
      active += state != PairState::Apart ? 1 : 0;
      presses = presses || state == PairState::Presses;
    });
    if (pass == 0) {
      const int crossed = min(__ldcg(&counts->crossings), frame.self.crossing_room());
      for (int k = thread; k < crossed; k += threads) {
        active += pull_out(cloth, crossings[k].x, crossings[k].y, rule, load_x, add) ? 1 : 0;
      }
      if (counted && active > 0) {
        atomicAdd(&counts->pushes, active);
      }
    }
    if (presses) {
      atomicMax(&counts->pressed, clock.serial);
    }
  }

  /// Gives every particle what pairs wanted of it, and watches its flight.
  __device__ void apply(const SelfClock& clock) const {
    for (int i = thread; i < frame.count; i += threads) {
      int given = 0;
      if (__ldcg(&sums[i].used) != 0) {
        const PushSum sum = load_sum(sums + i);
        given = sum.support;
        SelfParticle<T> p = load_particle(i);
        take_push(sum, load_origin(i), p);
        store(i, p);
        clear_sum(sums + i, kPushed);
        watch(i, xyz(p.x), clock);
      }
      __stcg(support + i, supported(i, given));
    }
  }

  __device__ void keep_pairs(int pass, const SelfClock& clock) const {
    const auto load_x = [&](int i) { return load(i); };
    const auto load_o = [&](int i) { return load_origin(i); };
    const auto carried = [&](int i) { return load_carry(i); };
    const auto slide = [&](int i, Vec3<T> push) {
      __stcg(&sums[i].used, kPushed);
      widen(sums[i].fresh, push);
    };
    const auto stay = [&](int i, Vec3<T> held) {
      __stcg(&sums[i].stay, 1);
      slide(i, held);
    };
    bool kept = false;
    visit_pairs([&](const SelfPair<T>& pair, bool edges) {
      kept =
          keep_back(cloth, pair, edges, pass < kSelfSlides, load_x, load_o, carried, slide, stay) ||
          kept;
    });
    if (kept) {
      atomicMax(&counts->kept, clock.serial);
    }
  }
};

/// How a particle that contacts moved meets the body.
enum class Meeting { Touches, Rides, Stays };

/// The body moves particle `i`, which contacts moved.
template <class T>
__device__ inline void meet_body(const SelfWork<T>& work, int i, int s, Meeting meeting,
                                 const Vec4<T>& origin, SelfParticle<T>& p) {
  const CudaFrame<T>& frame = work.frame;
  if (frame.body.face_count == 0) {
    return;
  }
  const int at = work.scene * frame.count + i;
  const T t0 = static_cast<T>(s) / static_cast<T>(frame.substeps);
  const T t1 = static_cast<T>(s + 1) / static_cast<T>(frame.substeps);
  const BodyContactRule<T> rule = body_rule_of(frame, work.scene);
  BodyParticle<T> b{p.x, p.start, load_shared_cache(frame.held + at), xyz(p.carry)};
  const bool touches = meeting == Meeting::Touches
                           ? touch_particle(frame, rule, at, b, t0, t1)
                           : stay_with_body(b, origin, frame.body, t0, t1, rule, frame.outlook[at],
                                            meeting == Meeting::Rides);
  p = {b.x, b.start, with_w(b.moved, p.carry.w)};
  store_shared_cache(frame.held + at, b.held);
  __stcg(work.touched + i, touches ? 1 : 0);
}

/// Gives particle `i` what its pairs want of it, then the body.
template <class T>
__device__ inline void move_particle(const SelfWork<T>& work, int i, int s, Meeting meeting,
                                     const SelfClock& clock) {
  if (__ldcg(&work.sums[i].used) != kPushed) {
    return;
  }
  const Vec4<T> origin = work.load_origin(i);
  SelfParticle<T> p = work.load_particle(i);
  take_push(load_sum(work.sums + i), origin, p);
  clear_sum(work.sums + i, kWasPushed);
  meet_body(work, i, s, meeting, origin, p);
  work.store(i, p);
  work.watch(i, xyz(p.x), clock);
}

/// Tethers, then the body, before cloth meets cloth.
template <class T, CudaBarrier kBarrier>
__device__ __noinline__ void touch_before_pairs(const CudaFrame<T>& frame, int blocks, int s,
                                                int iteration, SelfClock& clock, unsigned* arrived,
                                                unsigned& goal) {
  const SelfWork<T> work(frame, blocks);
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  ++clock.serial;
  if (iteration == 0 && clock.age >= 0 && ++clock.age > clock.ahead) {
    clock.age = -1;
  }
  const int pass = s * frame.iterations + iteration;
  const bool first = s == 0 && iteration == 0;
  hold_and_list(frame, blocks, s, pass);
  for (int i = work.thread; i < frame.count; i += work.threads) {
    if (frame.body.face_count > 0 &&
        comes_out(work.cloth, frame.outlook + work.scene * frame.count, i)) {
      const Vec4<T> carry = work.load_carry(i);
      store_shared_cache(work.carry + i, with_w(xyz(carry), T(1)));
    }
    __stcg(&work.sums[i].used, 0);
    if (first) {
      __stcg(work.support + i, 0);
      frame.self.slack[static_cast<std::int64_t>(work.scene) * frame.count + i] =
          frame.self.rule.slack;
    }
    work.watch(i, xyz(work.load(i)), clock);
  }
  wait();
  if (frame.body.face_count == 0) {
    return;
  }
  const int offset = work.scene * frame.count;
  touch_listed(
      frame, blocks, s, pass,
      [&](int i) {
        return BodyParticle<T>{work.load(i), load_shared_cache(work.start + i),
                               load_shared_cache(frame.held + offset + i), xyz(work.load_carry(i))};
      },
      [&](int i, const BodyParticle<T>& p, bool touches) {
        if (touches) {
          work.store(i, {p.x, p.start, with_w(p.moved, work.load_carry(i).w)});
          store_shared_cache(frame.held + offset + i, p.held);
          __stcg(work.touched + i, 1);
          __stcg(work.support + i, kSupportLevels);
          work.watch(i, xyz(p.x), clock);
        }
      });
  wait();
}

/// A new search for pairs. Not inlined, as it is asked for in two places.
template <class T, CudaBarrier kBarrier>
__device__ __noinline__ void search_pairs(const SelfWork<T>& work, int blocks,
                                          const SelfClock& clock, unsigned* arrived,
                                          unsigned& goal) {
  __shared__ int2 items[kFrameThreads / kGroup][PairQueue::kRoom];
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  const SelfSearch<T> search(work.frame.self, work.cloth, work.scene, work.thread, work.threads);
  work.begin_search(clock);
  wait();
  search.box_groups();
  wait();
  if (search.has_wholes()) {
    search.box_wholes();
    wait();
  }
  work.collect(search, items[threadIdx.x / kGroup]);
  wait();
  work.end_search();
}

/// A new search where the list of pairs does not hold.
template <class T, CudaBarrier kBarrier>
__device__ inline void renew_pairs(const SelfWork<T>& work, int blocks, int s, SelfClock& clock,
                                   unsigned* arrived, unsigned& goal) {
  if (clock.age >= 0 && __ldcg(&work.counts->stale) != clock.serial) {
    return;
  }
  work.give_slack(clock);
  clock.age = 1;
  clock.ahead = min(work.frame.self.rule.horizon, work.frame.substeps - s);
  search_pairs<T, kBarrier>(work, blocks, clock, arrived, goal);
}

/// Pushes pairs apart until none is pressed; then the body again.
template <class T, CudaBarrier kBarrier>
__device__ __noinline__ void push_apart_all(const CudaFrame<T>& frame, int blocks, int s,
                                            bool counted, SelfClock& clock, unsigned* arrived,
                                            unsigned& goal) {
  const SelfWork<T> work(frame, blocks);
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  for (int pass = 0;; ++pass) {
    renew_pairs<T, kBarrier>(work, blocks, s, clock, arrived, goal);
    work.push_pairs(pass, clock, counted);
    wait();
    const bool pressed = __ldcg(&work.counts->pressed) == clock.serial;
    ++clock.serial;
    if (!pressed || pass + 1 == kSelfPushes) {
      break;
    }
    work.apply(clock);
    wait();
  }
  for (int i = work.thread; i < frame.count; i += work.threads) {
    const int level = work.supported(i, __ldcg(&work.sums[i].support));
    move_particle(work, i, s, Meeting::Touches, clock);
    __stcg(work.support + i, level);
  }
  wait();
}

/// Keeps back what would pass, with the body, until nothing would; then the body once more.
template <class T, CudaBarrier kBarrier>
__device__ __noinline__ void keep_all_back(const CudaFrame<T>& frame, int blocks, int s,
                                           SelfClock& clock, unsigned* arrived, unsigned& goal) {
  const SelfWork<T> work(frame, blocks);
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  for (int pass = 0; pass < kSelfKeeps; ++pass) {
    renew_pairs<T, kBarrier>(work, blocks, s, clock, arrived, goal);
    work.keep_pairs(pass, clock);
    wait();
    if (__ldcg(&work.counts->kept) != clock.serial) {
      if (pass == 0) {
        return;
      }
      break;
    }
    ++clock.serial;
    const Meeting meeting = pass < kSelfSlides                ? Meeting::Touches
                            : pass < kSelfSlides + kSelfRides ? Meeting::Rides
                                                              : Meeting::Stays;
    for (int i = work.thread; i < frame.count; i += work.threads) {
      move_particle(work, i, s, meeting, clock);
    }
    wait();
  }
  for (int i = work.thread; i < frame.count; i += work.threads) {
    if (__ldcg(&work.sums[i].used) == kWasPushed) {
      SelfParticle<T> p = work.load_particle(i);
      meet_body(work, i, s, Meeting::Touches, work.load_origin(i), p);
      work.store(i, p);
    }
  }
  wait();
}

}  // namespace atelier
