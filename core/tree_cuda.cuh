#pragma once

#include "core/cuda_buffer.cuh"
#include "core/tree.h"
#include "core/tree_cuda.h"

namespace atelier {

/// A TriangleTree in device memory, T float or double: refitted and asked there. `view()` goes into
/// kernels that call nearest_in_tree or hit_in_tree (tree_math.h) themselves.
template <class T>
class CudaTree {
 public:
  /// Copies the tree; vertices are rounded to T and the boxes made from them on the device.
  explicit CudaTree(const TriangleTree& tree);

  /// Boxes from new vertices, [V] on the device, which are copied. Bottom-up, one launch per level
  /// until levels fit one block: no atomics, the same bits every time. Vertices must be finite;
  /// nothing here checks them.
  void refit(const Vec3<T>* vertices);

  /// Nearest points of n queries on the device.
  CudaBuffer<TreePoint<T>> nearest(const Vec3<T>* queries, std::size_t n,
                                   T max_squared_distance) const;

  /// Hits of n rays on the device.
  CudaBuffer<TreeHit<T>> hits(const TreeRay<T>* rays, std::size_t n, bool any) const;

  TreeView<T> view() const {
    return {nodes_.data(), faces_.data(), vertices_.data(), static_cast<int>(nodes_.size())};
  }

 private:
  void refit_boxes();

  CudaBuffer<TreeNode<T>> nodes_;
  CudaBuffer<TreeFace> faces_;
  CudaBuffer<Vec3<T>> vertices_;
  CudaBuffer<int> level_begin_on_device_;
  std::vector<int> level_begin_;
};

extern template class CudaTree<float>;
extern template class CudaTree<double>;

}  // namespace atelier
