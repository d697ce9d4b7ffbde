#pragma once

#include "core/triangle_math.h"

namespace atelier {

/// The flat arrays of a TriangleTree and how one query walks them: for both devices and both
/// precisions. The walk prunes with a margin that covers rounding, so that the answer is the one of
/// a loop over all faces, bit for bit, whatever the shape of the tree.

/// A box and what is in it.
template <class T>
struct TreeNode {
  Vec3<T> low, high;  ///< metres
  int first;          ///< left child (the right one follows), or first slot of a leaf
  int count;          ///< slots of a leaf, 0 for an inner node
};

/// One slot of a leaf: a face and its vertices.
struct TreeFace {
  int vertex[3];
  int face;
};

/// A tree as kernels see it. The root is node 0; children come after their parents.
template <class T>
struct TreeView {
  const TreeNode<T>* nodes;
  const TreeFace* faces;
  const Vec3<T>* vertices;
  int node_count;
};

/// The nearest point on the tree's triangles; face -1: none within the distance asked for.
template <class T>
struct TreePoint {
  int face;
  TrianglePoint<T> nearest;
};

/// A hit of a ray; face -1: none.
template <class T>
struct TreeHit {
  int face;
  T t;
  Vec3<T> barycentric;
};

/// Deepest path from the root; build_tree keeps to it.
inline constexpr int kTreeDepth = 64;

template <class T>
ATELIER_HOST_DEVICE inline Corners<T> corners_of(const TreeView<T>& tree, const TreeFace& face) {
  return {tree.vertices[face.vertex[0]],
          tree.vertices[face.vertex[1]],
          tree.vertices[face.vertex[2]],
          face.vertex[0],
          face.vertex[1],
          face.vertex[2]};
}

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> low_of(Vec3<T> a, Vec3<T> b) {
  return {smaller(a.x, b.x), smaller(a.y, b.y), smaller(a.z, b.z)};
}
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> high_of(Vec3<T> a, Vec3<T> b) {
  return {larger(a.x, b.x), larger(a.y, b.y), larger(a.z, b.z)};
}

/// Largest coordinate of anything in the tree.
template <class T>
ATELIER_HOST_DEVICE inline T extent_of(const TreeNode<T>& root) {
  return larger(largest_magnitude(root.low), largest_magnitude(root.high));
}

/// Box of one node from its slots or its children, whose boxes are up to date.
template <class T>
ATELIER_HOST_DEVICE inline void refit_node(TreeNode<T>* nodes, int i, const TreeFace* faces,
                                           const Vec3<T>* vertices) {
  TreeNode<T>& node = nodes[i];
  if (node.count == 0) {
    node.low = low_of(nodes[node.first].low, nodes[node.first + 1].low);
    node.high = high_of(nodes[node.first].high, nodes[node.first + 1].high);
    return;
  }
  node.low = node.high = vertices[faces[node.first].vertex[0]];
  for (int slot = node.first; slot < node.first + node.count; ++slot) {
    for (const int v : faces[slot].vertex) {
      node.low = low_of(node.low, vertices[v]);
      node.high = high_of(node.high, vertices[v]);
    }
  }
}

/// Squared distance from a point to a box, 0 inside.
template <class T>
ATELIER_HOST_DEVICE inline T squared_distance_to_box(Vec3<T> p, const TreeNode<T>& box) {
  const Vec3<T> gap = {larger(T(0), larger(box.low.x - p.x, p.x - box.high.x)),
                       larger(T(0), larger(box.low.y - p.y, p.y - box.high.y)),
                       larger(T(0), larger(box.low.z - p.z, p.z - box.high.z))};
  return squared_norm(gap);
}

/// Calls `visit(face)` for the faces of every leaf whose box may come within a squared distance of
/// p, nearest box first. `visit` returns the squared distance that still matters.
template <class T, class Visit>
ATELIER_HOST_DEVICE inline void walk_near(const TreeView<T>& tree, Vec3<T> p, T squared_distance,
                                          const Visit& visit) {
  if (tree.node_count == 0) {
    return;
  }
  // Rounding moves a computed distance by a few ulps of the coordinates; the smallest normal number
  // keeps infinity times the margin from being 0 * infinity.
  const T margin = 16 * kEpsilon<T> * (extent_of(tree.nodes[0]) + largest_magnitude(p)) + T(1e-37);
  const auto padded = [margin](T d2) { return d2 + margin * (2 * std::sqrt(d2) + margin); };
  T limit = padded(squared_distance);
  int stack[kTreeDepth];
  T distances[kTreeDepth];
  int top = 0;
  int i = 0;
  while (true) {
    const TreeNode<T>& node = tree.nodes[i];
    if (node.count > 0) {
      T still = squared_distance;
      for (int slot = node.first; slot < node.first + node.count; ++slot) {
        still = visit(tree.faces[slot]);
      }
      if (still < squared_distance) {
        squared_distance = still;
        limit = padded(still);
      }
    } else {
      int near = node.first;
      int far = node.first + 1;
      T near_distance = squared_distance_to_box(p, tree.nodes[near]);
      T far_distance = squared_distance_to_box(p, tree.nodes[far]);
      if (far_distance < near_distance) {
        const T d = near_distance;
        near_distance = far_distance;
        far_distance = d;
        near = node.first + 1;
        far = node.first;
      }
      if (near_distance <= limit) {
        if (far_distance <= limit) {
          stack[top] = far;
          distances[top++] = far_distance;
        }
        i = near;
        continue;
      }
    }
    do {
      if (top == 0) {
        return;
      }
      i = stack[--top];
    } while (!(distances[top] <= limit));
  }
}

/// Nearest point within a distance; of equally near faces the lowest.
template <class T>
ATELIER_HOST_DEVICE inline TreePoint<T> nearest_in_tree(const TreeView<T>& tree, Vec3<T> p,
                                                        T max_squared_distance) {
  TreePoint<T> best;
  best.face = -1;
  best.nearest = {{0, 0, 0}, {0, 0, 0}, max_squared_distance};
  walk_near(tree, p, max_squared_distance, [&](const TreeFace& face) {
    const TrianglePoint<T> found = nearest_on_triangle(p, corners_of(tree, face));
    const T d2 = found.squared_distance;
    const T best_d2 = best.nearest.squared_distance;
    if (d2 < best_d2 || (d2 == best_d2 && (best.face < 0 || face.face < best.face))) {
      best.face = face.face;
      best.nearest = found;
    }
    return best.nearest.squared_distance;
  });
  return best;
}

/// The reciprocal directions and padded origins of a ray for box tests (Ize, "Robust BVH ray
/// traversal", JCGT 2013): no box that holds a hit is missed.
template <class T>
struct BoxRay {
  Vec3<T> inverse;  // may be infinite
  Vec3<T> to_near;  // origin moved so that near planes come nearer
  Vec3<T> to_far;   // and far planes farther
};

template <class T>
ATELIER_HOST_DEVICE inline BoxRay<T> box_ray(Vec3<T> origin, Vec3<T> direction, T margin) {
  const Vec3<T> inverse = {1 / direction.x, 1 / direction.y, 1 / direction.z};
  const Vec3<T> side = {inverse.x < 0 ? -margin : margin, inverse.y < 0 ? -margin : margin,
                        inverse.z < 0 ? -margin : margin};
  return {inverse, origin + side, origin - side};
}

/// Enters the interval [t0, t1] cut with one pair of planes. 0 * infinity (a ray in the plane) is
/// NaN, which compares false and leaves the interval as it is.
template <class T>
ATELIER_HOST_DEVICE inline void cut_interval(T near, T far, T& t0, T& t1) {
  if (near > t0) {
    t0 = near;
  }
  if (far < t1) {
    t1 = far;
  }
}

/// True if a ray meets a box within [t0, t1]; `entry` is where.
template <class T>
ATELIER_HOST_DEVICE inline bool enters_box(const BoxRay<T>& ray, const TreeNode<T>& box, T t0, T t1,
                                           T& entry) {
  const bool x = ray.inverse.x < 0;
  const bool y = ray.inverse.y < 0;
  const bool z = ray.inverse.z < 0;
  cut_interval(((x ? box.high.x : box.low.x) - ray.to_near.x) * ray.inverse.x,
               ((x ? box.low.x : box.high.x) - ray.to_far.x) * ray.inverse.x, t0, t1);
  cut_interval(((y ? box.high.y : box.low.y) - ray.to_near.y) * ray.inverse.y,
               ((y ? box.low.y : box.high.y) - ray.to_far.y) * ray.inverse.y, t0, t1);
  cut_interval(((z ? box.high.z : box.low.z) - ray.to_near.z) * ray.inverse.z,
               ((z ? box.low.z : box.high.z) - ray.to_far.z) * ray.inverse.z, t0, t1);
  entry = t0;
  return t0 <= t1 + 4 * kEpsilon<T> * magnitude(t1);
}

/// First hit with t in [t_min, t_max]; of equally near faces the lowest. With `any`, the first that
/// is found.
template <class T>
ATELIER_HOST_DEVICE inline TreeHit<T> hit_in_tree(const TreeView<T>& tree, Vec3<T> origin,
                                                  Vec3<T> direction, T t_min, T t_max, bool any) {
  TreeHit<T> best = {-1, t_max, {0, 0, 0}};
  if (tree.node_count == 0) {
    return best;
  }
  const T margin = 16 * kEpsilon<T> * (extent_of(tree.nodes[0]) + largest_magnitude(origin));
  const T margin_t = margin / largest_magnitude(direction);
  const PreparedRay<T> ray = prepare_ray(origin, direction);
  const BoxRay<T> boxes = box_ray(origin, direction, margin);
  const T from = t_min - margin_t;
  T limit = t_max + margin_t;
  int stack[kTreeDepth];
  T entries[kTreeDepth];
  int top = 0;
  int i = 0;
  T entry = 0;
  if (!enters_box(boxes, tree.nodes[0], from, limit, entry)) {
    return best;
  }
  while (true) {
    const TreeNode<T>& node = tree.nodes[i];
    if (node.count > 0) {
      for (int slot = node.first; slot < node.first + node.count; ++slot) {
        const TreeFace& face = tree.faces[slot];
        const TriangleHit<T> found = intersect(ray, corners_of(tree, face));
        if (found.hit && found.t >= t_min &&
            (found.t < best.t || (found.t == best.t && (best.face < 0 || face.face < best.face)))) {
          best = {face.face, found.t, found.barycentric};
          limit = found.t + margin_t;
        }
      }
      if (any && best.face >= 0) {
        return best;
      }
    } else {
      int near = node.first;
      int far = node.first + 1;
      T near_entry = 0;
      T far_entry = 0;
      const bool near_hit = enters_box(boxes, tree.nodes[near], from, limit, near_entry);
      const bool far_hit = enters_box(boxes, tree.nodes[far], from, limit, far_entry);
      if (near_hit && far_hit) {
        if (far_entry < near_entry) {
          const T t = near_entry;
          near_entry = far_entry;
          far_entry = t;
          near = node.first + 1;
          far = node.first;
        }
        stack[top] = far;
        entries[top++] = far_entry;
        i = near;
        continue;
      }
      if (near_hit || far_hit) {
        i = near_hit ? near : far;
        continue;
      }
    }
    do {
      if (top == 0) {
        return best;
      }
      i = stack[--top];
    } while (entries[top] > limit + 4 * kEpsilon<T> * magnitude(limit));
  }
}

}  // namespace atelier
