#pragma once

#include "simulation/cuda_self_pairs.cuh"

namespace atelier {

/// How a particle that contacts moved meets the body.
enum class Meeting { Touches, Rides, Stays };

/// The body moves particle `at` (of all scenes), which contacts moved. Not inlined: few come here.
template <class T>
__device__ __noinline__ void meet_body(const CudaFrame<T>& frame, int scene, int at, int s,
                                       Meeting meeting, SelfParticle<T>& p) {
  if (frame.body.face_count == 0) {
    return;
  }
  const T t0 = static_cast<T>(s) / static_cast<T>(frame.substeps);
  const T t1 = static_cast<T>(s + 1) / static_cast<T>(frame.substeps);
  const BodyContactRule<T> rule = body_rule_of(frame, scene);
  BodyParticle<T> b{p.x, p.start, load_shared_cache(frame.held + at), xyz(p.carry)};
  const bool touches =
      meeting == Meeting::Touches
          ? touch_particle(frame, rule, at, b, t0, t1)
          : stay_with_body(b, load_shared_cache(frame.self.origin + at), frame.body, t0, t1, rule,
                           frame.outlook[at], meeting == Meeting::Rides);
  p = {b.x, b.start, with_w(b.moved, p.carry.w)};
  store_shared_cache(frame.held + at, b.held);
  __stcg(frame.touched + at, touches ? 1 : 0);
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
  meet_body(work.frame, work.scene, work.scene * work.frame.count + i, s, meeting, p);
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
    int* const emerges = frame.self.emerges + work.scene * frame.count + i;
    if (first) {
      __stcg(work.support + i, 0);
      frame.self.slack[static_cast<std::int64_t>(work.scene) * frame.count + i] =
          frame.self.rule.slack;
      *emerges = frame.body.face_count > 0 &&
                         comes_out(work.cloth, frame.outlook + work.scene * frame.count, i)
                     ? 1
                     : 0;
    }
    if (*emerges != 0) {
      const Vec4<T> carry = work.load_carry(i);
      store_shared_cache(work.carry + i, with_w(xyz(carry), T(1)));
    }
    __stcg(&work.sums[i].used, 0);
    work.watch(i, xyz(work.load(i)), clock);
  }
  wait();
  if (frame.body.face_count == 0) {
    return;
  }
  // These make their own SelfWork, else all of it would lie in memory.
  const int offset = work.scene * frame.count;
  touch_listed(
      frame, blocks, s, pass,
      [&frame, blocks, offset](int i) {
        const SelfWork<T> own(frame, blocks);
        return BodyParticle<T>{own.load(i), load_shared_cache(own.start + i),
                               load_shared_cache(frame.held + offset + i), xyz(own.load_carry(i))};
      },
      [&frame, &clock, blocks, offset](int i, const BodyParticle<T>& p, bool touches) {
        if (touches) {
          const SelfWork<T> own(frame, blocks);
          own.store(i, {p.x, p.start, with_w(p.moved, own.load_carry(i).w)});
          store_shared_cache(frame.held + offset + i, p.held);
          __stcg(own.touched + i, 1);
          __stcg(own.support + i, kSupportLevels);
          own.watch(i, xyz(p.x), clock);
        }
      });
  wait();
}

/// A search for all pairs, or for those of who has a new flight. Not inlined, as it is asked for in
/// two places.
template <class T, CudaBarrier kBarrier>
__device__ __noinline__ void search_pairs(const CudaFrame<T>& frame, int blocks,
                                          const SelfClock& clock, bool every, bool crossings,
                                          unsigned* arrived, unsigned& goal) {
  __shared__ int2 items[kFrameThreads / kGroup][PairQueue::kRoom];
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  const SelfWork<T> work(frame, blocks);
  SelfView<T> cloth = work.cloth;
  cloth.past = static_cast<T>(clock.age - 1) / static_cast<T>(clock.ahead);
  const SelfSearch<T> search(work.frame.self, cloth, work.flown, clock.search, every, crossings,
                             work.scene, work.thread, work.threads);
  if (every) {
    work.begin_search(clock);
    wait();
    work.clear_lists();  // not before: other blocks ask for them to decide on this search
  }
  search.box_groups();
  wait();
  if (search.has_wholes()) {
    search.box_wholes();
    wait();
  }
  work.collect(search, items[threadIdx.x / kGroup]);
  wait();
  work.end_search(every);
}

/// A search where the list of pairs does not hold.
template <class T, CudaBarrier kBarrier>
__device__ inline void renew_pairs(const SelfWork<T>& work, int blocks, int s, SelfClock& clock,
                                   unsigned* arrived, unsigned& goal) {
  if (clock.age >= 0 && __ldcg(&work.counts->stale) != clock.serial) {
    return;
  }
  const bool crossed = __ldcg(&work.counts->crossings) > 0;
  bool every = clock.age < 0;
  if (!every) {
    work.renew_flights(clock);
    scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks));
    const int left = __ldcg(&work.counts->left);
    if (left == 0) {  // the body brought it back
      return;
    }
    every = left > work.frame.count / kSelfFew || clock.kept || crossed;
  }
  if (every) {
    clock.age = 1;
    clock.ahead = min(work.frame.self.rule.horizon, work.frame.substeps - s);
  }
  ++clock.search;
  const bool crossings = every && (clock.search == 1 || clock.pressed || clock.kept || crossed);
  clock.pressed = clock.pressed && !crossings;
  clock.kept = clock.kept && !crossings;
  search_pairs<T, kBarrier>(work.frame, blocks, clock, every, crossings, arrived, goal);
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
    clock.pressed = clock.pressed || pressed;
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
    clock.kept = true;
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
      meet_body(frame, work.scene, work.scene * frame.count + i, s, Meeting::Touches, p);
      work.store(i, p);
    }
  }
  wait();
}

}  // namespace atelier
