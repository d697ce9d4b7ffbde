#pragma once

#include "simulation/cuda_contacts.cuh"
#include "simulation/self_crossing_math.h"
#include "simulation/self_search_math.h"

namespace atelier {

/// Search for the pairs of a cloth, a warp for each group of primitives (near_groups.h): it looks
/// through the boxes over groups of groups, then over groups, then over primitives, 32 at a time;
/// what meets there waits in a queue until each thread of the warp has a pair to look at. No tree:
/// nothing goes up or down level by level, and what one warp reads is read in one piece.

constexpr unsigned kWholeWarp = 0xFFFFFFFFu;

/// A warp among those of its scene.
struct SceneWarp {
  int index, count, lane;
};

template <class T>
__device__ inline Box<T> shuffled(const Box<T>& box, int lane) {
  const auto get = [&](T v) { return __shfl_sync(kWholeWarp, v, lane); };
  return {{get(box.low.x), get(box.low.y), get(box.low.z)},
          {get(box.high.x), get(box.high.y), get(box.high.z)}};
}

/// Box over those of a warp's threads, of which some may be empty.
template <class T>
__device__ inline Box<T> united_in_warp(Box<T> box) {
  for (int k = kGroup / 2; k > 0; k /= 2) {
    const auto lower = [&](T v) { return min_of(v, __shfl_xor_sync(kWholeWarp, v, k)); };
    const auto higher = [&](T v) { return max_of(v, __shfl_xor_sync(kWholeWarp, v, k)); };
    box = {{lower(box.low.x), lower(box.low.y), lower(box.low.z)},
           {higher(box.high.x), higher(box.high.y), higher(box.high.z)}};
  }
  return box;
}

template <class T>
__device__ inline BoxGroups<T> of_scene(BoxGroups<T> groups, int scene) {
  groups.box += static_cast<std::int64_t>(scene) * groups.groups() * kGroup;
  groups.group += static_cast<std::int64_t>(scene) * groups.groups();
  groups.whole += static_cast<std::int64_t>(scene) * groups.wholes();
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

__device__ inline GroupedItem shuffled(const GroupedItem& item, int lane) {
  return {__shfl_sync(kWholeWarp, item.a, lane), __shfl_sync(kWholeWarp, item.b, lane),
          __shfl_sync(kWholeWarp, item.c, lane), __shfl_sync(kWholeWarp, item.index, lane)};
}
__device__ inline bool share_a_particle(const GroupedItem& p, const GroupedItem& q) {
  return p.a == q.a || p.a == q.b || p.a == q.c || p.b == q.a || p.b == q.b || p.b == q.c ||
         p.c == q.a || p.c == q.b || p.c == q.c;
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

/// Pairs that wait for a full warp: of primitives, by index.
struct PairQueue {
  static constexpr int kRoom = 2 * kGroup;
  int2* items;  ///< [kRoom] on chip, this warp's
  int waiting = 0;

  /// Adds a pair of each thread that has one; `work(has, first, second)` takes them, 32 at a time.
  template <class Work>
  __device__ void add(bool has, int first, int second, int lane, const Work& work) {
    const unsigned votes = __ballot_sync(kWholeWarp, has);
    if (has) {
      items[waiting + __popc(votes & ((1u << lane) - 1u))] = make_int2(first, second);
    }
    waiting += __popc(votes);
    __syncwarp();
    if (waiting >= kGroup) {
      take(kGroup, lane, work);
    }
  }
  /// Hands out the last `count`.
  template <class Work>
  __device__ void take(int count, int lane, const Work& work) {
    waiting -= count;
    const bool has = lane < count;
    const int2 pair = has ? items[waiting + lane] : make_int2(0, 0);
    __syncwarp();
    work(has, pair.x, pair.y);
    __syncwarp();
  }
};

/// The primitives of one group, one a thread.
template <class T>
struct GroupInHand {
  int index;
  Box<T> around;
  Box<T> box;
  GroupedItem item;
};

/// Offers every pair of a primitive of the group in hand and one of group `partner` whose boxes
/// meet and that share no particle.
template <bool kSame, class T, class Work>
__device__ inline void visit_partner(const GroupInHand<T>& own, const BoxGroups<T>& b, int partner,
                                     int lane, PairQueue& queue, const Work& work) {
  const bool itself = kSame && partner == own.index;
  const Box<T> other = b.box[partner * kGroup + lane];
  const GroupedItem other_item = item_at(b, partner * kGroup + lane);
  const bool near = overlap(own.box, b.group[partner]);
  unsigned of_b = __ballot_sync(kWholeWarp, overlap(other, own.around));
  for (; of_b != 0; of_b &= of_b - 1) {
    const int j = __ffs(static_cast<int>(of_b)) - 1;
    const Box<T> box = shuffled(other, j);
    const GroupedItem item = shuffled(other_item, j);
    const bool meets =
        near && overlap(own.box, box) && (!itself || lane < j) && !share_a_particle(own.item, item);
    queue.add(meets, own.item.index, item.index, lane, work);
  }
}

/// Calls `work(has, first, second)`, all threads of the warp together, for every pair of
/// primitives, of `a` and of `b`, whose boxes meet and that share no particle. `kSame`: both are
/// one; then each pair once, in any order.
template <bool kSame, class T, class Work>
__device__ inline void visit_near(const BoxGroups<T>& a, const BoxGroups<T>& b,
                                  const SceneWarp& warp, int2* items, const Work& work) {
  PairQueue queue{items};
  const int lane = warp.lane;
  for (int k = warp.index; k < a.groups(); k += warp.count) {
    const int slot = k * kGroup + lane;
    const GroupInHand<T> own{k, a.group[k], a.box[slot], item_at(a, slot)};
    const auto visit_whole = [&](int whole) {
      const int g = whole * kGroup + lane;
      const bool meets = g < b.groups() && (!kSame || g >= k) && overlap(own.around, b.group[g]);
      unsigned groups = __ballot_sync(kWholeWarp, meets);
      for (; groups != 0; groups &= groups - 1) {
        const int partner = whole * kGroup + __ffs(static_cast<int>(groups)) - 1;
        visit_partner<kSame>(own, b, partner, lane, queue, work);
      }
    };
    const int first = kSame ? k / kGroup : 0;
    if (!b.many()) {
      for (int whole = first; whole < b.wholes(); ++whole) {
        visit_whole(whole);
      }
      continue;
    }
    for (int begin = first; begin < b.wholes(); begin += kGroup) {
      const int w = begin + lane;
      const bool meets = w < b.wholes() && overlap(own.around, b.whole[w]);
      unsigned wholes = __ballot_sync(kWholeWarp, meets);
      for (; wholes != 0; wholes &= wholes - 1) {
        visit_whole(begin + __ffs(static_cast<int>(wholes)) - 1);
      }
    }
  }
  queue.take(queue.waiting, lane, work);
}

/// The boxes of one scene while a search holds.
template <class T>
struct SelfSearch {
  const SelfView<T>& cloth;
  const SelfRule<T>& rule;
  BoxGroups<T> particles, edges, faces, edges_now, faces_now;
  SceneWarp warp;

  __device__ SelfSearch(const CudaSelfFrame<T>& self, const SelfView<T>& of_cloth, int scene,
                        int thread, int threads)
      : cloth(of_cloth),
        rule(self.rule),
        particles(of_scene(self.particles, scene)),
        edges(of_scene(self.edges, scene)),
        faces(of_scene(self.faces, scene)),
        edges_now(of_scene(self.edges_now, scene)),
        faces_now(of_scene(self.faces_now, scene)),
        warp{thread / kGroup, threads / kGroup, thread % kGroup} {}

  /// Boxes over primitives and groups, from the flights.
  __device__ void box_groups() const {
    const int count = edges.groups() + faces.groups() + particles.groups();
    for (int at = warp.index; at < count; at += warp.count) {
      int k = at;
      if (k < edges.groups()) {
        box_edges(k);
        continue;
      }
      k -= edges.groups();
      if (k < faces.groups()) {
        box_faces(k);
        continue;
      }
      k -= faces.groups();
      const int slot = k * kGroup + warp.lane;
      Box<T> box = empty_box<T>();
      if (slot < particles.count) {
        const int i = particles.item[slot].index;
        box = inflated(flight_box(cloth, i), search_margin(rule, slack_of(cloth, i, rule)));
      }
      store_group(particles, k, box, warp.lane);
    }
  }
  /// True if box_wholes() is to follow.
  __device__ bool has_wholes() const { return edges.many() || faces.many(); }
  /// Boxes over groups of groups.
  __device__ void box_wholes() const {
    unite_groups(edges, warp);
    unite_groups(faces, warp);
    unite_groups(faces_now, warp);
  }

  /// `put_edges(has, pair)`, `put_face(has, pair)` for what may meet, `put_crossing(has, edge,
  /// face)` for what is crossed now, by all threads of the warp together. `items`: on-chip room of
  /// the warp.
  template <class PutEdges, class PutFace, class PutCrossing>
  __device__ void look(int2* items, const PutEdges& put_edges, const PutFace& put_face,
                       const PutCrossing& put_crossing) const {
    visit_near<true>(edges, edges, warp, items, [&](bool has, int e, int o) {
      SelfPair<T> pair{};
      bool near = false;
      if (has) {
        offer_edge(cloth, min(e, o), max(e, o), rule, [&](const SelfPair<T>& p) {
          pair = p;
          near = true;
        });
      }
      put_edges(near, pair);
    });
    // Who has no group of edges has one of the others.
    visit_near<false>(
        edges_now, faces_now, after(edges.groups()), items,
        [&](bool has, int e, int f) { put_crossing(has && crosses_now(cloth, e, f), e, f); });
    visit_near<false>(particles, faces, after(2 * edges.groups()), items,
                      [&](bool has, int i, int f) {
                        SelfPair<T> pair{};
                        bool near = false;
                        if (has) {
                          offer_face(cloth, i, f, rule, [&](const SelfPair<T>& p) {
                            pair = p;
                            near = true;
                          });
                        }
                        put_face(near, pair);
                      });
  }

 private:
  /// This warp where `shift` tasks were dealt out before.
  __device__ SceneWarp after(int shift) const {
    const int index = warp.index - shift % warp.count;
    return {index < 0 ? index + warp.count : index, warp.count, warp.lane};
  }
  __device__ void box_edges(int k) const {
    const int slot = k * kGroup + warp.lane;
    Box<T> box = empty_box<T>();
    Box<T> now = empty_box<T>();
    if (slot < edges.count) {
      const ClothEdge e = cloth.edges[edges.item[slot].index];
      box = inflated(flight_box(cloth, e), search_margin(rule, edge_slack(cloth, e, rule)));
      grow(now, xyz(cloth.surface.start[e.a]));
      grow(now, xyz(cloth.surface.start[e.b]));
    }
    store_group(edges, k, box, warp.lane);
    store_group(edges_now, k, now, warp.lane);
  }
  __device__ void box_faces(int k) const {
    const int slot = k * kGroup + warp.lane;
    Box<T> box = empty_box<T>();
    Box<T> now = empty_box<T>();
    if (slot < faces.count) {
      const int face = faces.item[slot].index;
      const T slack = face_slack(cloth, cloth.surface.faces[face], rule);
      box = inflated(swept_box(cloth.surface, face), search_margin(rule, slack));
      now = box_now(cloth.surface, face);
    }
    store_group(faces, k, box, warp.lane);
    store_group(faces_now, k, now, warp.lane);
  }
};

}  // namespace atelier
