#pragma once

#include "simulation/contact/self_crossing_math.h"
#include "simulation/contact/self_search_math.h"
#include "simulation/xpbd/cuda_boxes.cuh"
#include "simulation/xpbd/cuda_contacts.cuh"

namespace atelier {

/// Search for the pairs of a cloth, a warp for each group of primitives (near_groups.h): it looks
/// through the boxes over groups of groups, then over groups, then over primitives, 32 at a time;
/// what meets there waits in a queue until each thread of the warp has a pair to look at. No tree:
/// nothing goes up or down level by level, and what one warp reads is read in one piece.

/// A warp among those of its scene.
struct SceneWarp {
  int index, count, lane;
};

template <class T>
__device__ inline BoxGroups<T> of_scene(BoxGroups<T> groups, int scene) {
  groups.box += static_cast<std::int64_t>(scene) * groups.groups() * kGroup;
  groups.group += static_cast<std::int64_t>(scene) * groups.groups();
  groups.whole += static_cast<std::int64_t>(scene) * groups.wholes();
  groups.fresh += static_cast<std::int64_t>(scene) * groups.groups();
  return groups;
}

/// Writes the boxes of group `k`; this thread's primitive has `box`.
template <class T>
__device__ inline void store_group(const BoxGroups<T>& groups, int k, const Box<T>& box, int lane) {
  groups.box[k * kGroup + lane] = box;
  const Box<T> all = united_in_warp(box);
  if (lane == 0) {
    groups.group[k] = all;
  }
}

/// Boxes over groups of groups.
template <class T>
__device__ inline void unite_groups(const BoxGroups<T>& groups, const SceneWarp& warp) {
  for (int k = warp.index; k < groups.wholes(); k += warp.count) {
    const int at = k * kGroup + warp.lane;
    const Box<T> all = united_in_warp(at < groups.groups() ? groups.group[at] : empty_box<T>());
    if (warp.lane == 0) {
      groups.whole[k] = all;
    }
  }
}

/// Of primitives with so many particles each.
template <int kFirst, int kSecond>
__device__ inline bool share_a_particle(const GroupedItem& p, const GroupedItem& q) {
  const int first[3] = {p.a, p.b, p.c};
  const int second[3] = {q.a, q.b, q.c};
  bool share = false;
#pragma unroll
  for (int i = 0; i < kFirst; ++i) {
#pragma unroll
    for (int j = 0; j < kSecond; ++j) {
      share |= first[i] == second[j];
    }
  }
  return share;
}
template <class T>
__device__ inline GroupedItem item_at(const BoxGroups<T>& groups, int slot) {
  return slot < groups.count ? groups.item[slot] : GroupedItem{-1, -1, -1, 0};
}

/// Appends what the threads of a warp have, all of them calling, to a list that many warps write;
/// what is beyond `room` is counted alone.
template <class Item>
__device__ inline void append_in_warp(Item* list, int* count, int room, bool has, const Item& item,
                                      int lane) {
  const unsigned votes = __ballot_sync(kWholeWarp, has);
  int first = 0;
  if (lane == 0 && votes != 0) {
    first = atomicAdd(count, __popc(votes));
  }
  first = __shfl_sync(kWholeWarp, first, 0);
  const int at = first + __popc(votes & ((1u << lane) - 1u));
  if (has && at < room) {
    list[at] = item;
  }
  __syncwarp();
}

/// On-chip memory of a warp that searches.
template <class T>
struct SearchRoom {
  Box<T> box[kGroup];  ///< of the group that it looks at
  GroupedItem item[kGroup];
  int2 pairs[2 * kGroup];  ///< see PairQueue
};

/// Pairs that wait for a full warp: of primitives, by index.
struct PairQueue {
  int2* items;  ///< [2 * kGroup] on chip, this warp's
  int lane;     ///< of this thread in it
  int waiting = 0;

  /// Adds a pair of each thread that has one; `work(has, first, second)` takes them, 32 at a time.
  template <class Work>
  __device__ void add(bool has, int first, int second, const Work& work) {
    const unsigned votes = __ballot_sync(kWholeWarp, has);
    if (has) {
      items[waiting + __popc(votes & ((1u << lane) - 1u))] = make_int2(first, second);
    }
    waiting += __popc(votes);
    __syncwarp();
    if (waiting >= kGroup) {
      take(kGroup, work);
    }
  }
  /// Hands out the last `count`.
  template <class Work>
  __device__ void take(int count, const Work& work) {
    waiting -= count;
    const bool has = lane < count;
    const int2 pair = has ? items[waiting + lane] : make_int2(0, 0);
    __syncwarp();
    work(has, pair.x, pair.y);
    __syncwarp();
  }
};

/// The primitives of one group, one a thread; who is not fresh has an empty box.
template <class T>
struct GroupInHand {
  int index;
  Box<T> around;
  Box<T> box;
  GroupedItem item;
};

/// Which pairs of fresh primitives are offered; those of a fresh and another one always are.
enum class FreshPairs {
  Once,  ///< of primitives of one kind, by the order of the groups
  All,
  None
};

/// Offers the pairs of a primitive of the group in hand and one of group `partner` whose boxes meet
/// and that share no particle: of `kOwn` and `kOther` particles each.
template <FreshPairs kPairs, int kOwn, int kOther, class T, class Work>
__device__ inline void visit_partner(const GroupInHand<T>& own, const BoxGroups<T>& b, int partner,
                                     SearchRoom<T>& room, PairQueue& queue, const Work& work) {
  const int lane = queue.lane;
  const Box<T> other = b.box[partner * kGroup + lane];
  __syncwarp();  // others may still read the partner before
  room.box[lane] = other;
  room.item[lane] = item_at(b, partner * kGroup + lane);
  unsigned others = __ballot_sync(kWholeWarp, overlap(other, own.around));
  if (kPairs == FreshPairs::None || (kPairs == FreshPairs::Once && partner < own.index)) {
    others &= ~b.fresh[partner];
  } else if (kPairs == FreshPairs::Once && partner == own.index) {
    // Who is not fresh meets none, as its box is empty.
    others &= ~(b.fresh[partner] & ((2u << lane) - 1u));
  }
  if (!overlap(own.box, b.group[partner])) {
    others = 0;
  }
  __syncwarp();
  unsigned hits = 0;  // among the partner's primitives, of this thread's
  for (; others != 0; others &= others - 1) {
    const int j = __ffs(static_cast<int>(others)) - 1;
    // What flies without end meets the empty boxes behind the last primitive as well.
    const bool meets = ((own.item.index | room.item[j].index) >= 0) &
                       overlap(own.box, room.box[j]) &
                       !share_a_particle<kOwn, kOther>(own.item, room.item[j]);
    hits |= static_cast<unsigned>(meets) << j;
  }
  while (__any_sync(kWholeWarp, hits != 0)) {
    const int j = hits != 0 ? __ffs(static_cast<int>(hits)) - 1 : 0;
    queue.add(hits != 0, own.item.index, room.item[j].index, work);
    hits &= hits - 1;
  }
}

/// Calls `work(has, first, second)`, all threads of the warp together, for the pairs of a fresh
/// primitive of `a` and one of `b` whose boxes meet and that share no particle, each once, in any
/// order. `every`: all are fresh; where few are, or groups, several warps share the partners of
/// one.
template <FreshPairs kPairs, int kOwn, int kOther, class T, class Work>
__device__ inline void visit_near(const BoxGroups<T>& a, const BoxGroups<T>& b,
                                  const SceneWarp& warp, bool every, SearchRoom<T>& room,
                                  const Work& work) {
  const int lane = warp.lane;
  PairQueue queue{room.pairs, lane};
  const int shares = !every || 4 * a.groups() <= warp.count ? 4
                     : 2 * a.groups() <= warp.count         ? 2
                                                            : 1;
  const unsigned some = shares == 4 ? 0x11111111u : shares == 2 ? 0x55555555u : kWholeWarp;
  for (int task = warp.index; task < shares * a.groups(); task += warp.count) {
    const int k = task / shares;
    const unsigned fresh = a.fresh[k];
    if (fresh == 0) {
      continue;
    }
    const int slot = k * kGroup + lane;
    GroupInHand<T> own{k, a.group[k], a.box[slot], item_at(a, slot)};
    if (!every) {
      own.box = (fresh >> lane & 1u) != 0 ? own.box : empty_box<T>();
      own.around = united_in_warp(own.box);
    }
    const unsigned share = some << (task % shares);
    const int least = kPairs == FreshPairs::Once && every ? k : 0;
    for (int begin = least / kGroup; begin < b.wholes(); begin += kGroup) {
      const int w = begin + lane;
      unsigned wholes =
          __ballot_sync(kWholeWarp, w < b.wholes() && (!b.many || overlap(own.around, b.whole[w])));
      for (; wholes != 0; wholes &= wholes - 1) {
        const int first = (begin + __ffs(static_cast<int>(wholes)) - 1) * kGroup;
        const int g = first + lane;
        const bool meets = g >= least && g < b.groups() && overlap(own.around, b.group[g]);
        unsigned groups = share & __ballot_sync(kWholeWarp, meets);
        for (; groups != 0; groups &= groups - 1) {
          visit_partner<kPairs, kOwn, kOther>(own, b, first + __ffs(static_cast<int>(groups)) - 1,
                                              room, queue, work);
        }
      }
    }
  }
  queue.take(queue.waiting, work);
}

/// Purpose of a search.
enum class Wanted { None, Part, All };
struct SearchPlan {
  Wanted pairs;      ///< Part: of who has flown since this search
  Wanted crossings;  ///< Part: around who was stirred in the substep before
  int number;        ///< of this search of pairs
  int substep;       ///< those before it, in this frame
};

/// The boxes of one scene while a search holds.
template <class T>
struct SelfSearch {
  SelfView<T> cloth;
  SelfRule<T> rule;
  BoxGroups<T> particles, edges, faces, edges_now, faces_now;
  const int* flown;
  const int* stirred;
  int* tangled;
  const Vec4<T>* origin;
  SearchPlan plan;
  SceneWarp warp;

  /// @param particles_before  of the scenes before this one
  __device__ SelfSearch(const CudaSelfFrame<T>& self, const SelfView<T>& of_cloth, int scene,
                        int particles_before, const SearchPlan& of_plan, const SceneWarp& of_warp)
      : cloth(of_cloth),
        rule(self.rule),
        particles(of_scene(self.particles, scene)),
        edges(of_scene(self.edges, scene)),
        faces(of_scene(self.faces, scene)),
        edges_now(of_scene(self.edges_now, scene)),
        faces_now(of_scene(self.faces_now, scene)),
        flown(self.flown + particles_before),
        stirred(self.stirred + particles_before),
        tangled(self.tangled + particles_before),
        origin(self.origin + particles_before),
        plan(of_plan),
        warp(of_warp) {}

  /// Boxes over primitives and groups, from the swept motions.
  __device__ void box_groups() const {
    const int count = edges.groups() + faces.groups() + particles.groups();
    for (int at = warp.index; at < count; at += warp.count) {
      int k = at;
      if (k < edges.groups()) {
        box_group(
            edges, edges_now, k, [&](int e) { return cloth.edges[e]; },
            [&](const ClothEdge& e) { return edge_slack(cloth, e, rule); });
        continue;
      }
      k -= edges.groups();
      if (k < faces.groups()) {
        box_group(
            faces, faces_now, k, [&](int f) { return cloth.surface.faces[f]; },
            [&](const FaceIndices& f) { return face_slack(cloth, f, rule); });
        continue;
      }
      k -= faces.groups();
      const int slot = k * kGroup + warp.lane;
      const int i = slot < particles.count ? particles.item[slot].index : -1;
      if (plan.pairs != Wanted::None && any_of(particles, k, plan.pairs, flown, plan.number)) {
        const Box<T> box =
            i >= 0 ? inflated(swept_bound(cloth, i), search_margin(rule, slack_of(cloth, i, rule)))
                   : empty_box<T>();
        store_group(particles, k, box, warp.lane);
      }
      if (plan.crossings != Wanted::None && i >= 0) {
        tangled[i] = 0;
      }
    }
  }
  /// True if box_wholes() is to follow.
  __device__ bool has_wholes() const { return edges.many || faces.many || particles.many; }
  /// Boxes over groups of groups.
  __device__ void box_wholes() const {
    if (plan.pairs != Wanted::None) {
      unite_groups(particles, warp);
      unite_groups(edges, warp);
      unite_groups(faces, warp);
    }
    if (plan.crossings != Wanted::None) {
      unite_groups(edges_now, warp);
      unite_groups(faces_now, warp);
    }
  }

  /// `put(has, pair)` for the edges that may meet, by all threads of the warp together.
  template <class Put>
  __device__ void look_for_edges(SearchRoom<T>& room, const Put& put) const {
    const bool every = plan.pairs == Wanted::All;
    visit_near<FreshPairs::Once, 2, 2>(
        edges, edges, warp, every, room, [&](bool has, int e, int o) {
          SelfPair<T> pair{};
          bool near = false;
          if (has) {
            offer_edge(cloth, min(e, o), max(e, o), rule, [&](const SelfPair<T>& p) {
              pair = p;
              near = true;
            });
          }
          put(near, pair);
        });
  }
  /// The same for particles and faces. Who has no group of edges has one of these.
  template <class Put>
  __device__ void look_for_faces(SearchRoom<T>& room, const Put& put) const {
    const bool every = plan.pairs == Wanted::All;
    const auto offer = [&](bool has, int i, int f) {
      SelfPair<T> pair{};
      bool near = false;
      if (has) {
        offer_face(cloth, i, f, rule, [&](const SelfPair<T>& p) {
          pair = p;
          near = true;
        });
      }
      put(near, pair);
    };
    visit_near<FreshPairs::All, 1, 3>(particles, faces, after(edges.groups()), every, room, offer);
    if (!every) {
      visit_near<FreshPairs::None, 3, 1>(faces, particles,
                                         after(edges.groups() + particles.groups()), false, room,
                                         [&](bool has, int f, int i) { offer(has, i, f); });
    }
  }
  /// `put(has, edge, face)` for what is crossed now.
  template <class Put>
  __device__ void look_for_crossings(SearchRoom<T>& room, const Put& put) const {
    const bool every = plan.crossings == Wanted::All;
    const SceneWarp last = after(edges.groups() + particles.groups());
    const auto cross = [&](bool has, int e, int f) {
      put(has && crosses_at(cloth.edges[e], cloth.surface.faces[f], start()), e, f);
    };
    visit_near<FreshPairs::All, 2, 3>(edges_now, faces_now, last, every, room, cross);
    if (!every) {
      visit_near<FreshPairs::None, 3, 2>(faces_now, edges_now, last, false, room,
                                         [&](bool has, int f, int e) { cross(has, e, f); });
    }
  }

 private:
  /// This warp where `shift` tasks were dealt out before.
  __device__ SceneWarp after(int shift) const {
    const int index = warp.index - shift % warp.count;
    return {index < 0 ? index + warp.count : index, warp.count, warp.lane};
  }
  /// Where the substep began.
  __device__ auto start() const {
    return [this](int i) { return load_shared_cache(origin + i); };
  }
  /// Notes which primitives of the warp's group `k` are wanted: all, or those of which a particle's
  /// `mark` is `number`. True if there is one.
  __device__ bool any_of(const BoxGroups<T>& groups, int k, Wanted wanted, const int* mark,
                         int number) const {
    const GroupedItem item = item_at(groups, k * kGroup + warp.lane);
    const bool is = item.a >= 0 && (wanted == Wanted::All || mark[item.a] == number ||
                                    mark[item.b] == number || mark[item.c] == number);
    const unsigned fresh = __ballot_sync(kWholeWarp, is);
    if (warp.lane == 0) {
      groups.fresh[k] = fresh;
    }
    return fresh != 0;
  }
  /// Boxes over a group of edges or faces, of swept motions and where the substep began. `at(slot)`
  /// is the primitive, `slack(primitive)` that of its particles.
  template <class At, class Slack>
  __device__ void box_group(const BoxGroups<T>& flights, const BoxGroups<T>& now, int k,
                            const At& at, const Slack& slack) const {
    const int slot = k * kGroup + warp.lane;
    const bool has = slot < flights.count;
    if (plan.pairs != Wanted::None && any_of(flights, k, plan.pairs, flown, plan.number)) {
      Box<T> box = empty_box<T>();
      if (has) {
        const auto primitive = at(flights.item[slot].index);
        box = inflated(swept_bound(cloth, primitive), search_margin(rule, slack(primitive)));
      }
      store_group(flights, k, box, warp.lane);
    }
    if (plan.crossings != Wanted::None) {
      any_of(now, k, plan.crossings, stirred, plan.substep);
      store_group(now, k, has ? box_at(at(now.item[slot].index), start()) : empty_box<T>(),
                  warp.lane);
    }
  }
};

}  // namespace atelier
