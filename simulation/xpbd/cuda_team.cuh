#pragma once

#include <cooperative_groups.h>

#include "simulation/contact/body_contact_math.h"
#include "simulation/xpbd/near_groups.h"

namespace atelier {

/// Threads of a team that look things up for one particle together: searches wait for memory, and
/// eight of them wait no longer than one.
constexpr int kTeam = 8;

/// On-chip memory of a team of `kSize` threads in a body.
template <int kSize>
struct TeamRoom {
  static constexpr int kStack = 256;  ///< nodes
  static constexpr int kLeaves = 32 + 3 * kSize;
  static constexpr int kFound = 32;

  int stack[kStack];
  int leaves[kLeaves];
  int length;
  int found[kFound];  ///< what a visit leaves for the whole team
};

/// A team of `kSize` threads that asks a body (see AloneInTree). All of its threads call its
/// functions together; `visit` shares what it finds out among them. `kBoxes`: it goes through
/// boxes, a few steps; else through the tree: twenty that wait for one another, but less to look
/// at, which is better where other scenes fill the waits.
template <int kSize, bool kBoxes>
struct TeamInBody {
  static constexpr int kDeepest = 64;  ///< of a tree
  static constexpr int kStack = TeamRoom<kSize>::kStack;
  static constexpr int kLeaves = TeamRoom<kSize>::kLeaves;

  cooperative_groups::thread_block_tile<kSize> tile;
  TeamRoom<kSize>& memory;

  __device__ int rank() const { return static_cast<int>(tile.thread_rank()); }

  template <class T, class Visit>
  __device__ void visit(const BodyView<T>& body, const Box<T>& query, const Visit& visit) const {
    if (rank() == 0) {
      memory.length = 0;
    }
    if constexpr (kBoxes) {
      visit_boxes(body, query, visit);
    } else {
      visit_tree(body, query, visit);
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
    for (int k = kSize / 2; k > 0; k /= 2) {
      value += tile.shfl_xor(value, k);
    }
    return value;
  }
  template <class Item, class Better>
  __device__ Item best(Item item, const Better& better) const {
    for (int k = kSize / 2; k > 0; k /= 2) {
      const Item other = tile.shfl_xor(item, k);
      if (better(other, item)) {
        item = other;
      }
    }
    return item;
  }

  /// The list is one of the whole team; its order varies.
  __device__ int place(int&) const { return atomicAdd(&memory.length, 1); }
  __device__ int length(int) const {
    const int length = memory.length;
    tile.sync();  // before the next visit begins a new list
    return length;
  }

 private:
  /// How many threads before this one, and in all, say yes.
  struct Vote {
    int before, all;
  };
  __device__ Vote vote(bool yes) const {
    const unsigned votes = tile.ballot(yes);
    return {__popc(votes & ((1u << tile.thread_rank()) - 1u)), __popc(votes)};
  }

  template <class T, class Visit>
  __device__ void visit_tree(const BodyView<T>& body, const Box<T>& query,
                             const Visit& visit) const {
    int top = 1;
    int found = 0;
    if (rank() == 0) {
      memory.stack[0] = 0;
    }
    tile.sync();
    const auto hand_out = [&] {
      for (int k = rank(); k < found; k += kSize) {
        visit(memory.leaves[k]);
      }
      tile.sync();
      found = 0;
    };
    while (top > 0) {
      // Where the stack could run over, one thread goes on alone, deep before wide.
      const int open = top + 2 * kSize + kDeepest <= kStack ? min(top, kSize) : 1;
      top -= open;
      const bool works = rank() < open;
      BoxNode<T> node;
      bool meets[2] = {false, false};
      if (works) {
        node = body.nodes[memory.stack[top + rank()]];
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
      if (found > kLeaves - 2 * kSize || top == 0) {
        hand_out();
      }
    }
  }

  /// Which of the kGroup boxes from `begin` on meet `query`, a bit each.
  template <class T>
  __device__ unsigned meeting(const Box<T>* boxes, int begin, const Box<T>& query) const {
    unsigned bits = 0;
#pragma unroll
    for (int k = 0; k < kGroup; k += kSize) {
      bits |= tile.ballot(overlap(boxes[begin + k + rank()], query)) << k;
    }
    return bits;
  }

  template <class T, class Visit>
  __device__ void visit_boxes(const BodyView<T>& body, const Box<T>& query,
                              const Visit& visit) const {
    const FaceBoxes<T>& boxes = body.boxes;
    int found = 0;
    int first = -kSize;
    int whole = 0;
    unsigned wholes = 0;  // that meet, from `first` on
    unsigned groups = 0;  // of `whole`
    bool more = true;
    while (more) {
      if (groups != 0) {
        const int begin = (whole * kGroup + __ffs(static_cast<int>(groups)) - 1) * kGroup;
        groups &= groups - 1;
        const unsigned leaves = meeting(boxes.box, begin, query);
        for (int k = rank(); k < kGroup; k += kSize) {
          if ((leaves >> k & 1u) != 0) {
            memory.leaves[found + __popc(leaves & ((1u << k) - 1u))] = boxes.face[begin + k];
          }
        }
        found += __popc(leaves);
      } else if (wholes != 0) {
        whole = first + __ffs(static_cast<int>(wholes)) - 1;
        wholes &= wholes - 1;
        groups = meeting(boxes.group, whole * kGroup, query);
      } else {
        first += kSize;
        more = first < boxes.wholes;
        const int w = first + rank();
        wholes = tile.ballot(w < boxes.wholes && overlap(boxes.whole[w], query));
      }
      if (found > kLeaves - kGroup || !more) {
        tile.sync();
        for (int k = rank(); k < found; k += kSize) {
          visit(memory.leaves[k]);
        }
        tile.sync();
        found = 0;
      }
    }
  }
};

/// One thread that looks at its candidates alone (choose_candidate).
struct OneThread {
  __device__ int rank() const { return 0; }
  template <class T>
  __device__ FaceChoice<T> choose(const BodyView<T>& body, const int* candidates, int count,
                                  const Passage<T>& way, T reach, bool swept) const {
    return choose_candidate(body, candidates, count, way, reach, swept);
  }
};

/// A team that looks at the candidates of one particle together, with the choice that one thread
/// would make.
struct TeamOfChoice {
  cooperative_groups::thread_block_tile<kTeam> tile;

  __device__ int rank() const { return static_cast<int>(tile.thread_rank()); }

  template <class T>
  __device__ FaceChoice<T> choose(const BodyView<T>& body, const int* candidates, int count,
                                  const Passage<T>& way, T reach, bool swept) const {
    constexpr int kEach = kBodyCandidates / kTeam;
    int face[kEach];
    T squared[kEach];
    T side[kEach];
    T least = T(2) * reach * reach;
    int passed = -1;
    T time = T(2);
#pragma unroll
    for (int k = 0; k < kEach; ++k) {
      const int c = rank() + k * kTeam;
      face[k] = -1;
      squared[k] = T(0);
      side[k] = T(0);
      if (c < count) {
        const FaceOffer<T> offer = offer_of(body, candidates[c], way, swept);
        face[k] = offer.face;
        squared[k] = offer.squared_distance;
        side[k] = std::fabs(offer.side);
        if (offer.face >= 0) {
          least = min_of(least, offer.squared_distance);
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
    FaceChoice<T> choice{no_offer(reach), no_offer(reach)};
    if (time <= T(1)) {
      choice.first = offer_of(body, passed, way, swept);
      return choice;
    }
    if (least > reach * reach) {
      return choice;
    }
    const T near = as_near(least);
    int nearest = -1;
    T widest = T(-1);
#pragma unroll
    for (int k = 0; k < kEach; ++k) {
      if (face[k] >= 0 && squared[k] <= near &&
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
    choice.nearest = offer_of(body, nearest, way, false);
    return choice;
  }
};

}  // namespace atelier
