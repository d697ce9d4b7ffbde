#pragma once

#include <cooperative_groups.h>

#include "simulation/body_contact_math.h"

namespace atelier {

/// Threads of a team that look things up for one particle together: searches wait for memory, and
/// eight of them wait no longer than one.
constexpr int kTeam = 8;

/// A team of threads that asks a tree (see AloneInTree). All of its threads call its functions
/// together; `visit` shares what it finds out among them.
struct TeamInTree {
  static constexpr int kDeepest = 64;  ///< of a tree
  static constexpr int kStack = 256;   ///< nodes
  static constexpr int kLeaves = 64;

  /// On-chip memory of a team.
  struct Memory {
    int stack[kStack];
    int leaves[kLeaves];
    int length;
  };

  cooperative_groups::thread_block_tile<kTeam> tile;
  Memory& memory;

  __device__ int rank() const { return static_cast<int>(tile.thread_rank()); }

  /// How many threads before this one, and in all, say yes.
  struct Vote {
    int before, all;
  };
  __device__ Vote vote(bool yes) const {
    const unsigned votes = tile.ballot(yes);
    return {__popc(votes & ((1u << tile.thread_rank()) - 1u)), __popc(votes)};
  }

  template <class T, class Visit>
  __device__ void visit(const BoxNode<T>* nodes, const Box<T>& query, const Visit& visit) const {
    int top = 1;
    int found = 0;
    if (rank() == 0) {
      memory.stack[0] = 0;
      memory.length = 0;
    }
    tile.sync();
    const auto hand_out = [&] {
      for (int k = rank(); k < found; k += kTeam) {
        visit(memory.leaves[k]);
      }
      tile.sync();
      found = 0;
    };
    while (top > 0) {
      // Where the stack could run over, one thread goes on alone, deep before wide.
      const int open = top + 2 * kTeam + kDeepest <= kStack ? min(top, kTeam) : 1;
      top -= open;
      const bool works = rank() < open;
      BoxNode<T> node;
      bool meets[2] = {false, false};
      if (works) {
        node = nodes[memory.stack[top + rank()]];
        meets[0] = overlap(node.box[0], query);
        meets[1] = overlap(node.box[1], query);
      }
      tile.sync();
      for (int side = 0; side < 2; ++side) {
        const bool leaf = meets[side] && node.child[side] < 0;
        const bool inner = meets[side] && node.child[side] >= 0;
        const Vote leaves = vote(leaf);
        const Vote inners = vote(inner);
        if (leaf) {
          memory.leaves[found + leaves.before] = ~node.child[side];
        }
        if (inner) {
          memory.stack[top + inners.before] = node.child[side];
        }
        found += leaves.all;
        top += inners.all;
      }
      tile.sync();
      if (found > kLeaves - 2 * kTeam || top == 0) {
        hand_out();
      }
    }
  }

  template <class T>
  __device__ T least(T value) const {
    return best(value, [](T a, T b) { return a < b; });
  }
  template <class T>
  __device__ T most(T value) const {
    return best(value, [](T a, T b) { return a > b; });
  }
  __device__ int sum(int value) const {
    for (int k = kTeam / 2; k > 0; k /= 2) {
      value += tile.shfl_xor(value, k);
    }
    return value;
  }
  template <class Item, class Better>
  __device__ Item best(Item item, const Better& better) const {
    for (int k = kTeam / 2; k > 0; k /= 2) {
      const Item other = tile.shfl_xor(item, k);
      if (better(other, item)) {
        item = other;
      }
    }
    return item;
  }
  /// The list is one of the whole team; its order varies.
  __device__ int place(int&) const { return atomicAdd(&memory.length, 1); }
  __device__ int length(int) const { return memory.length; }
};

/// The choice among `count` candidates (choose_candidate) for a particle of every thread of a warp
/// that `asks`: teams take one after the other. All threads of the warp call it together.
template <class T>
__device__ inline FaceChoice<T> choose_together(const BodyView<T>& body, bool asks,
                                                const int* candidates, int count, Vec3<T> p0,
                                                Vec3<T> p1, T t0, T t1, T reach, bool swept) {
  namespace cg = cooperative_groups;
  const cg::thread_block_tile<32> warp = cg::tiled_partition<32>(cg::this_thread_block());
  const cg::thread_block_tile<kTeam> tile = cg::tiled_partition<kTeam>(warp);
  constexpr int kTeams = 32 / kTeam;
  constexpr int kEach = kBodyCandidates / kTeam;
  const int rank = static_cast<int>(tile.thread_rank());
  const int team = static_cast<int>(tile.meta_group_rank());
  const unsigned lane = warp.thread_rank();
  const auto with = [&](Vec3<T> v, int from) {
    return Vec3<T>{warp.shfl(v.x, from), warp.shfl(v.y, from), warp.shfl(v.z, from)};
  };
  int first_face = -1;
  int nearest_face = -1;
  for (unsigned waiting = warp.ballot(asks); waiting != 0;) {
    // The team's particle is that of the lowest thread that the teams before do not take.
    unsigned mine = waiting;
    for (int k = 0; k < team; ++k) {
      mine &= mine - 1;
    }
    const bool works = mine != 0;
    const int owner = works ? __ffs(static_cast<int>(mine)) - 1 : 0;
    const Vec3<T> from = with(p0, owner);
    const Vec3<T> to = with(p1, owner);
    const int size = warp.shfl(count, owner);
    const int* const list = reinterpret_cast<const int*>(
        warp.shfl(reinterpret_cast<unsigned long long>(candidates), owner));
    int face[kEach];
    T squared[kEach];
    T side[kEach];
    T least = reach * reach;
    bool found = false;
    int passed = -1;
    T time = T(2);
#pragma unroll
    for (int k = 0; k < kEach; ++k) {
      const int c = rank + k * kTeam;
      face[k] = -1;
      squared[k] = T(0);
      side[k] = T(0);
      if (works && c < size) {
        const FaceOffer<T> offer = offer_of(body, list[c], from, to, t0, t1, swept);
        if (offer.face >= 0) {
          face[k] = offer.face;
          squared[k] = offer.squared_distance;
          side[k] = std::fabs(offer.side);
          if (offer.squared_distance <= least) {
            least = offer.squared_distance;
            found = true;
          }
        }
        if (offer.time < time || (offer.time == time && time <= T(1) && offer.face < passed)) {
          time = offer.time;
          passed = offer.face;
        }
      }
    }
    for (int k = kTeam / 2; k > 0; k /= 2) {
      least = min_of(least, tile.shfl_xor(least, k));
      const T other_time = tile.shfl_xor(time, k);
      const int other = tile.shfl_xor(passed, k);
      if (other_time < time || (other_time == time && time <= T(1) && other < passed)) {
        time = other_time;
        passed = other;
      }
    }
    found = tile.any(found);
    const T near = as_near(least);
    int nearest = -1;
    T widest = T(-1);
#pragma unroll
    for (int k = 0; k < kEach; ++k) {
      if (found && face[k] >= 0 && squared[k] <= near &&
          (side[k] > widest || (side[k] == widest && face[k] < nearest))) {
        widest = side[k];
        nearest = face[k];
      }
    }
    for (int k = kTeam / 2; k > 0; k /= 2) {
      const T other_side = tile.shfl_xor(widest, k);
      const int other = tile.shfl_xor(nearest, k);
      if (other_side > widest || (other_side == widest && other < nearest)) {
        widest = other_side;
        nearest = other;
      }
    }
    // Back to the owners: the k-th lowest waiting thread asks the k-th team.
    const int place = __popc(waiting & ((1u << lane) - 1u));
    const bool served = (waiting >> lane & 1u) != 0 && place < kTeams;
    const int source = served ? place * kTeam : 0;
    const int got_first = warp.shfl(time <= T(1) ? passed : -1, source);
    const int got_nearest = warp.shfl(nearest, source);
    if (served) {
      first_face = got_first;
      nearest_face = got_nearest;
    }
    for (int k = 0; k < kTeams && waiting != 0; ++k) {
      waiting &= waiting - 1;
    }
  }
  FaceChoice<T> choice{no_offer(reach), no_offer(reach)};
  if (first_face >= 0) {
    choice.first = offer_of(body, first_face, p0, p1, t0, t1, true);
  } else if (nearest_face >= 0) {
    choice.nearest = offer_of(body, nearest_face, p0, p1, t0, t1, false);
  }
  return choice;
}

}  // namespace atelier
