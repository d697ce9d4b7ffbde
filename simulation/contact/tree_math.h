#pragma once

#include <cstdint>

#include "core/vec.h"

namespace atelier {

/// Axis-aligned box. Aligned, so that it comes in three loads.
template <class T>
struct alignas(2 * sizeof(T)) Box {
  Vec3<T> low, high;
};

template <class T>
ATELIER_HOST_DEVICE inline Box<T> empty_box() {
  constexpr T kFar = T(1e30);
  return {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
}
template <class T>
ATELIER_HOST_DEVICE inline T min_of(T a, T b) {
  return b < a ? b : a;
}
template <class T>
ATELIER_HOST_DEVICE inline T max_of(T a, T b) {
  return b > a ? b : a;
}
template <class T>
ATELIER_HOST_DEVICE inline void grow(Box<T>& box, Vec3<T> p) {
  box.low = {min_of(box.low.x, p.x), min_of(box.low.y, p.y), min_of(box.low.z, p.z)};
  box.high = {max_of(box.high.x, p.x), max_of(box.high.y, p.y), max_of(box.high.z, p.z)};
}
template <class T>
ATELIER_HOST_DEVICE inline Box<T> united(const Box<T>& a, const Box<T>& b) {
  // Lows with lows: an empty box adds nothing.
  return {{min_of(a.low.x, b.low.x), min_of(a.low.y, b.low.y), min_of(a.low.z, b.low.z)},
          {max_of(a.high.x, b.high.x), max_of(a.high.y, b.high.y), max_of(a.high.z, b.high.z)}};
}
template <class T>
ATELIER_HOST_DEVICE inline Box<T> inflated(const Box<T>& box, T margin) {
  const Vec3<T> m{margin, margin, margin};
  return {box.low - m, box.high + m};
}
/// All six are asked at once: a branch after each would make every load wait for the one before.
template <class T>
ATELIER_HOST_DEVICE inline bool overlap(const Box<T>& a, const Box<T>& b) {
  const bool x = (a.low.x <= b.high.x) & (b.low.x <= a.high.x);
  const bool y = (a.low.y <= b.high.y) & (b.low.y <= a.high.y);
  const bool z = (a.low.z <= b.high.z) & (b.low.z <= a.high.z);
  return x & y & z;
}

/// A node of a binary tree over boxes with the boxes of both children, so that one load decides
/// about both; aligned, so that it comes in a few wide ones. A child below 0 is the primitive
/// ~child.
template <class T>
struct alignas(16) BoxNode {
  Box<T> box[2];
  int child[2];
};

/// Where a node or primitive hangs: `2 * parent + side`, or -1 at the root.
using TreeParent = int;

ATELIER_HOST_DEVICE inline std::uint32_t spread_bits(std::uint32_t v) {
  v = (v | (v << 16)) & 0x030000FFu;
  v = (v | (v << 8)) & 0x0300F00Fu;
  v = (v | (v << 4)) & 0x030C30C3u;
  v = (v | (v << 2)) & 0x09249249u;
  return v;
}

/// Key of a primitive in the linear order: 30 bits of the Morton code of `p` in the box, and the
/// index, so that keys are unique.
template <class T>
ATELIER_HOST_DEVICE inline std::uint64_t tree_key(Vec3<T> p, const Box<T>& bounds,
                                                  std::uint32_t index) {
  const Vec3<T> size = bounds.high - bounds.low;
  const auto cell = [](T x, T low, T extent) {
    const T share = extent > T(0) ? (x - low) / extent : T(0);
    const T scaled = share * T(1023);
    return static_cast<std::uint32_t>(scaled < T(0) ? T(0) : scaled > T(1023) ? T(1023) : scaled);
  };
  const std::uint32_t code = (spread_bits(cell(p.x, bounds.low.x, size.x)) << 2) |
                             (spread_bits(cell(p.y, bounds.low.y, size.y)) << 1) |
                             spread_bits(cell(p.z, bounds.low.z, size.z));
  return (static_cast<std::uint64_t>(code) << 32) | index;
}

ATELIER_HOST_DEVICE inline int leading_zeros(std::uint64_t v) {
#ifdef __CUDA_ARCH__
  return __clzll(static_cast<long long>(v));
#else
  return v == 0 ? 64 : __builtin_clzll(v);
#endif
}

/// Common prefix of the keys at places i and j, -1 out of range.
ATELIER_HOST_DEVICE inline int common_prefix(const std::uint64_t* keys, int count, int i, int j) {
  return j < 0 || j >= count ? -1 : leading_zeros(keys[i] ^ keys[j]);
}

/// Children of inner node `i` over sorted unique keys (Karras 2012, "Maximizing parallelism in the
/// construction of BVHs, octrees, and k-d trees"): node 0 is the root; a child below 0 is the place
/// ~child in the order of the keys.
struct TreeChildren {
  int left, right;
};
ATELIER_HOST_DEVICE inline TreeChildren tree_children(const std::uint64_t* keys, int count, int i) {
  const int direction =
      common_prefix(keys, count, i, i + 1) > common_prefix(keys, count, i, i - 1) ? 1 : -1;
  const int floor = common_prefix(keys, count, i, i - direction);
  int most = 2;
  while (common_prefix(keys, count, i, i + most * direction) > floor) {
    most *= 2;
  }
  int length = 0;
  for (int t = most / 2; t > 0; t /= 2) {
    if (common_prefix(keys, count, i, i + (length + t) * direction) > floor) {
      length += t;
    }
  }
  const int j = i + length * direction;
  const int prefix = common_prefix(keys, count, i, j);
  int split = 0;
  int t = length;
  do {
    t = (t + 1) / 2;
    if (common_prefix(keys, count, i, i + (split + t) * direction) > prefix) {
      split += t;
    }
  } while (t > 1);
  const int gamma = i + split * direction + (direction < 0 ? -1 : 0);
  const int low = i < j ? i : j;
  const int high = i < j ? j : i;
  return {low == gamma ? ~gamma : gamma, high == gamma + 1 ? ~(gamma + 1) : gamma + 1};
}

/// Calls `visit(primitive)` for every primitive whose box meets `query`, in an order that only
/// depends on the tree.
template <class T, class Visit>
ATELIER_HOST_DEVICE inline void visit_tree(const BoxNode<T>* nodes, const Box<T>& query,
                                           const Visit& visit) {
  int stack[64];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const BoxNode<T> node = nodes[stack[--top]];
    for (int side = 0; side < 2; ++side) {
      if (overlap(node.box[side], query)) {
        const int child = node.child[side];
        if (child < 0) {
          visit(~child);
        } else {
          stack[top++] = child;
        }
      }
    }
  }
}

/// One thread that asks the tree alone. A team of threads (cuda_team.cuh) has the same functions:
/// its threads share the visits out and bring together what each has found.
struct AloneInTree {
  template <class Body, class T, class Visit>
  ATELIER_HOST_DEVICE void visit(const Body& body, const Box<T>& query, const Visit& visit) const {
    visit_tree(body.nodes, query, visit);
  }
  template <class T>
  ATELIER_HOST_DEVICE T least(T value) const {
    return value;
  }
  template <class T>
  ATELIER_HOST_DEVICE T most(T value) const {
    return value;
  }
  ATELIER_HOST_DEVICE int sum(int value) const { return value; }
  /// The better of what each has found, by `better(a, b)`.
  template <class Item, class Better>
  ATELIER_HOST_DEVICE Item best(const Item& item, const Better&) const {
    return item;
  }
  /// The next place in a list that grows.
  ATELIER_HOST_DEVICE int place(int& count) const { return count++; }
  /// How long the list has become.
  ATELIER_HOST_DEVICE int length(int count) const { return count; }
};

}  // namespace atelier
