#pragma once

#include "simulation/xpbd/cuda_self_pairs.cuh"

namespace atelier {

/// On-chip memory that the warps of a block use by turns.
template <class T>
union WarpRoom {
  TeamRoom<32> body;
  SearchRoom<T> search;
};
template <class T>
__device__ inline WarpRoom<T>& own_warp_room() {
  __shared__ WarpRoom<T> rooms[kFrameThreads / kGroup];
  return rooms[threadIdx.x / kGroup];
}

/// The body moves particle `at` (of all scenes), which contacts moved; `anew`: it carries others
/// only where the body touches it now. Not inlined: few come here.
template <class T>
__device__ __noinline__ void meet_body(const CudaFrame<T>& frame, int scene, int at, int s,
                                       Meeting meeting, bool anew, SelfParticle<T>& p) {
  if (frame.body.face_count == 0) {
    return;
  }
  BodySubstep<T> step = body_substep(frame, scene, s);
  const bool holds = frame.held != nullptr;
  const bool has_impulses = frame.impulses.of != nullptr;
  if (has_impulses && meeting != Meeting::Touches) {
    step.rule = frame.impulses.rule;
  }
  BodyParticle<T> b{p.x, p.start, holds ? load_shared_cache(frame.held + at) : Vec4<T>{},
                    xyz(p.carry)};
  const bool touches = meeting == Meeting::Touches
                           ? touch_particle(frame, step, at, b)
                           : stay_with_body(b, load_shared_cache(frame.self.origin + at), step,
                                            frame.outlook[at], meeting);
  p = {b.x, b.start, with_w(anew && !touches ? Vec3<T>{} : b.moved, p.carry.w)};
  if (holds) {
    store_shared_cache(frame.held + at, b.held);
  }
  if (touches || !has_impulses) {
    __stcg(frame.touched + at, touches ? 1 : 0);
  }
}

/// Gives particle `i` what its pairs want of it, then the body. `as`: how it is marked for the rest
/// of the substep. `anew`: what the body asked of it before is forgotten.
template <class T>
__device__ inline void move_particle(const SelfWork<T>& work, int i, int s, Meeting meeting, int as,
                                     const SelfClock& clock, bool anew = false) {
  const auto without_push = [](Vec4<T> carry) { return with_w(Vec3<T>{}, carry.w); };
  if (__ldcg(&work.sums[i].used) != kPushed) {
    if (anew) {
      store_shared_cache(work.carry + i, without_push(work.load_carry(i)));
    }
    return;
  }
  const Vec4<T> origin = work.load_origin(i);
  SelfParticle<T> p = work.load_particle(i);
  take_response(load_sum(work.sums + i), origin, p);
  clear_sum(work.sums + i, as);
  if (anew) {
    p.carry = without_push(p.carry);
  }
  meet_body(work.frame, work.scene, work.scene * work.frame.count + i, s, meeting, anew, p);
  work.store(i, p);
  work.watch(i, xyz(p.x), clock);
}

/// At a substep's start: pairs grow older, and whether what is crossed is looked for.
__device__ inline void begin_pairs(SelfClock& clock, const SelfCounts& counts, bool first) {
  if (clock.age >= 0 && ++clock.age > clock.ahead) {
    clock.age = -1;
  }
  const bool due = clock.passed || __ldcg(&counts.crossings) > 0;
  clock.crossings = first ? Wanted::All : due ? Wanted::Part : Wanted::None;
  clock.passed = false;
}

/// Begins the frame for particle `i` (`first`), or marks it where contacts moved it since the last
/// look for crossings: in the substep before, or in an earlier iteration of this one.
template <class T>
__device__ inline void note_stirred(const SelfWork<T>& work, int i, int s, int iteration,
                                    bool first) {
  if (first) {
    const CudaFrame<T>& frame = work.frame;
    const int offset = work.scene * frame.count;
    __stcg(work.support + i, 0);
    frame.self.slack[offset + i] = frame.self.rule.slack;
    const bool out = frame.body.face_count > 0 && comes_out(work.cloth, frame.outlook + offset, i);
    frame.self.emerges[offset + i] = out ? 1 : 0;
    __stcg(work.stirred + i, 0);
  } else {
    const bool was_stirred = __ldcg(&work.sums[i].used) != 0;
    // The first search of a frame has not said yet what is crossed.
    const bool was_tangled = iteration == 0 && work.cloth.tangled[i] != 0;
    if (was_stirred || was_tangled) {
      work.stir(i, was_stirred && iteration > 0 ? s : s - 1);
    }
  }
  __stcg(&work.sums[i].used, 0);
}

/// Tethers, then the body, before cloth meets cloth.
template <class T, CudaBarrier kBarrier>
__device__ __noinline__ void touch_before_pairs(const CudaFrame<T>& frame, int blocks, int s,
                                                int iteration, SelfClock& clock, unsigned* arrived,
                                                unsigned& goal) {
  const SelfWork<T> work(frame, blocks);
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  ++clock.serial;
  const int pass = s * frame.iterations + iteration;
  const bool first = s == 0 && iteration == 0;
  if (iteration == 0) {
    begin_pairs(clock, *work.counts, first);
  }
  hold_and_list(frame, blocks, s, pass);
  for (int i = work.thread; i < frame.count; i += work.threads) {
    note_stirred(work, i, s, iteration, first);
    if (frame.self.emerges[work.scene * frame.count + i] != 0) {
      const Vec4<T> carry = work.load_carry(i);
      store_shared_cache(work.carry + i, with_w(xyz(carry), T(1)));
    }
    if (pushed_before(frame, work.scene * frame.count + i) != 0) {
      __stcg(work.support + i, kSupportLevels);
    }
    work.watch(i, xyz(work.load(i)), clock);
  }
  wait();
  if (frame.body.face_count == 0) {
    return;
  }
  // These make their own SelfWork, else all of it would lie in memory.
  const int offset = work.scene * frame.count;
  touch_listed<kBarrier != CudaBarrier::Block>(
      frame, blocks, s, pass, own_warp_room<T>().body,
      [&frame, blocks, offset](int i) {
        const SelfWork<T> own(frame, blocks);
        return BodyParticle<T>{
            own.load(i), load_shared_cache(own.start + i),
            frame.held != nullptr ? load_shared_cache(frame.held + offset + i) : Vec4<T>{},
            xyz(own.load_carry(i))};
      },
      [&frame, &clock, blocks, offset](int i, const BodyParticle<T>& p, bool touches) {
        if (touches) {
          const SelfWork<T> own(frame, blocks);
          own.store(i, {p.x, p.start, with_w(p.moved, own.load_carry(i).w)});
          if (frame.held != nullptr) {
            store_shared_cache(frame.held + offset + i, p.held);
          }
          __stcg(own.touched + i, 1);
          __stcg(own.support + i, kSupportLevels);
          own.watch(i, xyz(p.x), clock);
        }
      });
  wait();
}

/// `past`: share of the swept motions that lies behind.
template <class T>
__device__ inline SelfSearch<T> search_of(const SelfWork<T>& work, T past, const SearchPlan& plan) {
  SelfView<T> cloth = work.cloth;
  cloth.past = past;
  const SceneWarp warp{work.thread / kGroup, work.threads / kGroup, work.thread % kGroup};
  return SelfSearch<T>(work.frame.self, cloth, work.scene, work.scene * work.frame.count, plan,
                       warp);
}

/// The parts of a search, each a function that makes its own views: registers then hold what it
/// needs, and not what the others do.
template <class T>
__device__ __noinline__ void collect_edges(const CudaFrame<T>& frame, int blocks, T past,
                                           SearchPlan plan, SearchRoom<T>& room) {
  const SelfWork<T> work(frame, blocks);
  work.collect_edges(search_of(work, past, plan), room);
}
template <class T>
__device__ __noinline__ void collect_faces(const CudaFrame<T>& frame, int blocks, T past,
                                           SearchPlan plan, SearchRoom<T>& room) {
  const SelfWork<T> work(frame, blocks);
  work.collect_faces(search_of(work, past, plan), room);
}
template <class T>
__device__ __noinline__ void collect_crossings(const CudaFrame<T>& frame, int blocks,
                                               SearchPlan plan, SearchRoom<T>& room) {
  const SelfWork<T> work(frame, blocks);
  work.collect_crossings(search_of(work, T(0), plan), room);
}

/// A search. Not inlined, as it is asked for in two places.
template <class T, CudaBarrier kBarrier>
__device__ __noinline__ void search_pairs(const CudaFrame<T>& frame, int blocks,
                                          const SelfClock& clock, const SearchPlan& plan,
                                          unsigned* arrived, unsigned& goal) {
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  const SelfWork<T> work(frame, blocks);
  const T past = static_cast<T>(clock.age - 1) / static_cast<T>(clock.ahead);
  const SelfSearch<T> search = search_of(work, past, plan);
  work.clear_lists(plan);
  if (plan.pairs == Wanted::All) {
    work.begin_search(clock);
    wait();
  }
  search.box_groups();
  wait();
  if (search.has_wholes()) {
    search.box_wholes();
    wait();
  }
  SearchRoom<T>& room = own_warp_room<T>().search;
  if (plan.pairs != Wanted::None) {
    collect_edges(frame, blocks, past, plan, room);
    collect_faces(frame, blocks, past, plan, room);
  }
  if (plan.crossings != Wanted::None) {
    collect_crossings(frame, blocks, plan, room);
  }
  wait();
  work.end_search(plan);
}

/// A search where the list of pairs does not hold, and for what is crossed where that is due.
template <class T, CudaBarrier kBarrier>
__device__ inline void renew_pairs(const SelfWork<T>& work, int blocks, int s, SelfClock& clock,
                                   unsigned* arrived, unsigned& goal) {
  SearchPlan plan{Wanted::None, clock.crossings, clock.search + 1, s};
  clock.crossings = Wanted::None;
  if (clock.age < 0) {
    plan.pairs = Wanted::All;
  } else if (__ldcg(&work.counts->stale) == clock.serial) {
    work.renew_swept_bounds(clock);
    scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks));
    const int left = __ldcg(&work.counts->left);
    if (left > 0) {  // else the body brought it back
      plan.pairs = left > work.frame.count / kSelfFew ? Wanted::All : Wanted::Part;
    }
  }
  if (plan.pairs == Wanted::None && plan.crossings == Wanted::None) {
    return;
  }
  if (plan.pairs == Wanted::All) {
    clock.age = 1;
    clock.ahead = min(work.frame.self.rule.horizon, work.frame.substeps - s);
  }
  clock.search += plan.pairs == Wanted::None ? 0 : 1;
  search_pairs<T, kBarrier>(work.frame, blocks, clock, plan, arrived, goal);
}

/// Pushes pairs apart until none is pressed; then the body again. False where there is no pair and
/// nothing is crossed: then nothing is to be kept back either.
template <class T, CudaBarrier kBarrier>
__device__ __noinline__ bool push_apart_all(const CudaFrame<T>& frame, int blocks, int s,
                                            bool counted, SelfClock& clock, unsigned* arrived,
                                            unsigned& goal) {
  const SelfWork<T> work(frame, blocks);
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  for (int pass = 0;; ++pass) {
    renew_pairs<T, kBarrier>(work, blocks, s, clock, arrived, goal);
    if (pass == 0 && work.has_nothing()) {
      ++clock.serial;
      for (int i = work.thread; i < frame.count; i += work.threads) {
        __stcg(work.support + i, work.supported(i, __ldcg(&work.sums[i].support)));
      }
      return false;  // nobody reads what was written before the next barrier
    }
    work.push_pairs(pass, clock, counted);
    wait();
    const bool pressed = __ldcg(&work.counts->pressed) == clock.serial;
    ++clock.serial;
    if (!pressed || pass + 1 == kSelfResponses) {
      break;
    }
    work.apply(clock);
    wait();
  }
  for (int i = work.thread; i < frame.count; i += work.threads) {
    const int level = work.supported(i, __ldcg(&work.sums[i].support));
    move_particle(work, i, s, Meeting::Touches, kWasPushed, clock);
    __stcg(work.support + i, level);
  }
  wait();
  return true;
}

/// Keeps back what would pass, with the body, until nothing would or the passes of `Keeps` are
/// over; then the body once more.
template <class T, CudaBarrier kBarrier, class Keeps>
__device__ __noinline__ void keep_all_back(const CudaFrame<T>& frame, int blocks, int s,
                                           SelfClock& clock, unsigned* arrived, unsigned& goal) {
  const SelfWork<T> work(frame, blocks);
  const auto wait = [&] { scene_barrier<kBarrier>(arrived, goal, static_cast<unsigned>(blocks)); };
  for (int pass = 0; pass < Keeps::kPasses; ++pass) {
    renew_pairs<T, kBarrier>(work, blocks, s, clock, arrived, goal);
    work.keep_pairs(pass, s, clock);
    wait();
    clock.passed = clock.passed || __ldcg(&work.counts->passed) == clock.serial;
    if (__ldcg(&work.counts->kept) != clock.serial) {
      if (pass == 0) {
        return;
      }
      break;
    }
    ++clock.serial;
    const bool anew = Keeps::asks_body_anew(pass);
    for (int i = work.thread; i < frame.count; i += work.threads) {
      move_particle(work, i, s, meeting_in_pass(pass), kWasKept, clock, anew);
    }
    wait();
  }
  for (int i = work.thread; i < frame.count; i += work.threads) {
    if (__ldcg(&work.sums[i].used) == kWasKept) {
      SelfParticle<T> p = work.load_particle(i);
      meet_body(frame, work.scene, work.scene * frame.count + i, s, Meeting::Leaves, false, p);
      work.store(i, p);
    }
  }
  wait();
}

}  // namespace atelier
