#pragma once

#include "simulation/contact/body_surface_math.h"

namespace atelier {

/// A box that another thread wrote a moment ago, past the caches of this multiprocessor.
template <class T>
__device__ inline Box<T> load_box(const Box<T>* box) {
  const volatile Box<T>* b = box;
  return {{b->low.x, b->low.y, b->low.z}, {b->high.x, b->high.y, b->high.z}};
}

/// Carries the box of one face up the tree; of the two that arrive at a node, the second goes on.
/// `arrivals` are counters of the nodes, 0 before and after.
template <class T>
__device__ inline void refit_from_box(Box<T> box, int face, BoxNode<T>* nodes,
                                      const TreeParent* node_parent, const TreeParent* leaf_parent,
                                      unsigned* arrivals) {
  TreeParent parent = leaf_parent[face];
  while (parent >= 0) {
    const int node = parent / 2;
    nodes[node].box[parent % 2] = box;
    __threadfence();
    if (atomicAdd(&arrivals[node], 1u) == 0) {
      return;
    }
    arrivals[node] = 0;
    __threadfence();
    box = united(load_box(&nodes[node].box[0]), load_box(&nodes[node].box[1]));
    parent = node_parent[node];
  }
}

}  // namespace atelier
