#pragma once

#include "simulation/xpbd/cuda_response_sums.cuh"
#include "simulation/xpbd/cuda_self_search.cuh"

namespace atelier {

/// How far the contacts of a scene with itself are: the same numbers in each of its blocks.
struct SelfClock {
  int age = -1;         ///< substeps since the search for pairs, this one included; -1: none
  int ahead = 1;        ///< substeps that the search looked ahead
  int serial = 0;       ///< of the pass
  int search = 0;       ///< of the frame, of all pairs or of a part
  bool passed = false;  ///< something did or would have since the last look for crossings
  Wanted crossings = Wanted::None;  ///< to be looked for in this substep
};

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
  ResponseSum* sums;
  int* support;
  int* touched;  ///< null: no body
  int* flown;
  int* stirred;
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
    flown = s.flown + n;
    stirred = s.stirred + n;
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

  /// Asks for a new search where a particle left its swept motion.
  __device__ void watch(int i, Vec3<T> xi, const SelfClock& clock) const {
    if (clock.age >= 0 &&
        left_swept_bound(cloth, i, xi, static_cast<T>(clock.age) / static_cast<T>(clock.ahead),
                         frame.self.rule)) {
      atomicMax(&counts->stale, clock.serial);
    }
  }

  /// New swept motions for who left theirs, or may soon (renew_swept_bound), and counts them. The
  /// next search is theirs.
  __device__ void renew_swept_bounds(const SelfClock& clock) const {
    const CudaSelfFrame<T>& s = frame.self;
    const std::int64_t n = static_cast<std::int64_t>(scene) * frame.count;
    int left = 0;
    for (int i = thread; i < frame.count; i += threads) {
      const Vec3<T> origin = xyz(load_origin(i));
      if (renew_swept_bound({clock.age, clock.ahead}, xyz(load(i)), origin, s.start[n + i],
                            s.end[n + i], s.slack[n + i])) {
        flown[i] = clock.search + 1;
        ++left;
      }
    }
    for (int step = kGroup / 2; step > 0; step /= 2) {  // __reduce_add_sync needs Ampere
      left += __shfl_down_sync(kWholeWarp, left, step);
    }
    if (left > 0 && threadIdx.x % kGroup == 0) {
      atomicAdd(&counts->left, left);
    }
  }

  /// Where the particles are and where they fly.
  __device__ void begin_search(const SelfClock& clock) const {
    Vec4<T>* const from = frame.self.start + static_cast<std::int64_t>(scene) * frame.count;
    Vec4<T>* const to = frame.self.end + static_cast<std::int64_t>(scene) * frame.count;
    for (int i = thread; i < frame.count; i += threads) {
      const Vec4<T> xi = load(i);
      const Vec4<T> si = load_origin(i);
      from[i] = si;
      to[i] = with_w(xyz(si) + static_cast<T>(clock.ahead) * (xyz(xi) - xyz(si)), xi.w);
      flown[i] = clock.search;
    }
  }
  /// Empties the lists that a search fills anew.
  __device__ void clear_lists(const SearchPlan& plan) const {
    if (thread == 0 && plan.pairs == Wanted::All) {
      counts->face_pairs = 0;
      counts->edge_pairs = 0;
    }
    if (thread == 0 && plan.crossings != Wanted::None) {
      counts->crossings = 0;
    }
  }
  /// Fill the lists. `room`: of this thread's warp.
  __device__ void collect_edges(const SelfSearch<T>& search, SearchRoom<T>& room) const {
    const int most = frame.self.edge_room();
    search.look_for_edges(room, [&](bool has, SelfPair<T> pair) {
      pair.search = search.plan.number;
      append_in_warp(edge_pairs, &counts->edge_pairs, most, has, pair, search.warp.lane);
    });
  }
  __device__ void collect_faces(const SelfSearch<T>& search, SearchRoom<T>& room) const {
    const int most = frame.self.room;
    search.look_for_faces(room, [&](bool has, SelfPair<T> pair) {
      pair.search = search.plan.number;
      append_in_warp(face_pairs, &counts->face_pairs, most, has, pair, search.warp.lane);
    });
  }
  __device__ void collect_crossings(const SelfSearch<T>& search, SearchRoom<T>& room) const {
    const int most = frame.self.crossing_room();
    int* const tangled = frame.self.tangled + static_cast<std::int64_t>(scene) * frame.count;
    search.look_for_crossings(room, [&](bool has, int e, int face) {
      append_in_warp(crossings, &counts->crossings, most, has, make_int2(e, face),
                     search.warp.lane);
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
  __device__ void end_search(const SearchPlan& plan) const {
    if (thread == 0) {
      counts->left = 0;
      counts->searches += plan.pairs == Wanted::All ? 1 : 0;
      counts->renewals += plan.pairs == Wanted::Part ? 1 : 0;
      counts->most = max(
          counts->most,
          CudaSelfFrame<T>::room_for(counts->face_pairs, counts->edge_pairs, counts->crossings));
    }
  }

  /// True where the lists are empty: nothing is pushed, nor kept back.
  __device__ bool has_nothing() const {
    return __ldcg(&counts->face_pairs) == 0 && __ldcg(&counts->edge_pairs) == 0 &&
           __ldcg(&counts->crossings) == 0;
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

  /// True for a pair that a later search has found again, as one of its particles left its swept
  /// motion. Twice in the list does no harm: pushes are extremes.
  __device__ bool found_again(const SelfPair<T>& pair, bool edges) const {
    int particle[4];
    pair_particles(cloth, pair, edges, particle);
    return flown[particle[0]] > pair.search || flown[particle[1]] > pair.search ||
           flown[particle[2]] > pair.search || flown[particle[3]] > pair.search;
  }

  __device__ void push_pairs(int pass, const SelfClock& clock, bool counted) const {
    SelfRule<T> rule = frame.self.rule;
    if (pass > 0) {  // old overlaps and crossings are worked at once a substep
      rule.old_overlap = T(0);
      rule.untangle = T(0);
    }
    const auto load_x = [&](int i) { return load(i); };
    const auto load_o = [&](int i) { return load_origin(i); };
    const auto motion = motion_of(load_x, load_o);
    const auto level = [&](int i) { return __ldcg(support + i); };
    const auto add = [&](int i, Vec3<T> fresh, Vec3<T> off, int given) {
      add_response(sums + i, fresh, off, given);
    };
    int active = 0;
    bool presses = false;
    visit_pairs([&](SelfPair<T> pair, bool edges) {
      pair.gap *= frame.self.gap_share;
      const PairState state = edges ? push_edge_edge(cloth, pair, rule, motion, level, add)
                                    : push_vertex_face(cloth, pair, rule, motion, level, add);
      active += counted && state != PairState::Apart && !found_again(pair, edges) ? 1 : 0;
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

  /// Gives every particle what pairs wanted of it, and watches its swept motion.
  __device__ void apply(const SelfClock& clock) const {
    for (int i = thread; i < frame.count; i += threads) {
      int given = 0;
      if (__ldcg(&sums[i].used) != 0) {
        const ResponseSum sum = load_sum(sums + i);
        given = sum.support;
        SelfParticle<T> p = load_particle(i);
        take_response(sum, load_origin(i), p);
        store(i, p);
        clear_sum(sums + i, kPushed);
        watch(i, xyz(p.x), clock);
      }
      __stcg(support + i, supported(i, given));
    }
  }

  /// Marks particle `i` for the look for crossings after substep `s`.
  __device__ void stir(int i, int s) const { __stcg(stirred + i, s + 1); }

  __device__ void keep_pairs(int pass, int s, const SelfClock& clock) const {
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
    bool passed = false;
    visit_pairs([&](const SelfPair<T>& pair, bool edges) {
      const Passing passing =
          keep_back(cloth, pair, edges, pass < kSelfSlides, motion_of(load_x, load_o),
                    keeping_of(carried, slide, stay));
      kept = kept || passing == Passing::Kept;
      passed = passed || passing != Passing::No;
      if (passing == Passing::Free) {
        int particle[4];
        pair_particles(cloth, pair, edges, particle);
        for (int k = 0; k < 4; ++k) {
          stir(particle[k], s);
        }
      }
    });
    if (kept) {
      atomicMax(&counts->kept, clock.serial);
    }
    if (passed) {
      atomicMax(&counts->passed, clock.serial);
    }
  }
};

}  // namespace atelier
