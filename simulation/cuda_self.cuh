#pragma once

#include "core/cuda_buffer.cuh"
#include "simulation/cuda_scene.cuh"
#include "simulation/prepared_surface.h"

namespace atelier {

/// Contact of the cloth with itself on the device: the surface and its tree, the pairs of the
/// frame.
template <class T>
class CudaSelf {
 public:
  CudaSelf(const Cloth& cloth, const PreparedCloth<T>& prepared, const XpbdOptions& options,
           int scenes);

  /// Refits the trees to the particles' flight and collects the pairs of the frame.
  void collect(const Vec4<T>* x, const Vec4<T>* velocity, T frame);
  /// Tells the frame where the pairs are.
  void describe(CudaFrame<T>& frame);
  /// Fills in counts of contacts, candidates and lost candidates.
  void count(std::vector<FrameReport>& reports) const;
  /// Forgets pushes that were not applied.
  void reset() { sums_.clear(); }

 private:
  SelfView<T> view(int scene) const;

  int scenes_;
  int particles_;
  int face_count_;
  int edge_count_;
  SelfRule<T> rule_;
  CudaBuffer<FaceIndices> faces_;
  CudaBuffer<ClothEdge> edges_;
  CudaBuffer<int> face_edges_;
  CudaBuffer<Vec4<T>> rest_;
  CudaBuffer<int> layer_;
  CudaBuffer<BoxNode<T>> nodes_;  ///< [scenes][inner]
  CudaBuffer<TreeParent> node_parent_;
  CudaBuffer<TreeParent> leaf_parent_;
  CudaBuffer<unsigned> arrivals_;
  CudaBuffer<Vec4<T>> start_, end_;
  CudaBuffer<int> tangled_;
  CudaBuffer<PushSum> sums_;
  CudaBuffer<int> face_pair_count_;
  CudaBuffer<SelfPair<T>> face_pairs_;
  CudaBuffer<int2> edge_pair_count_;
  CudaBuffer<SelfPair<T>> edge_pairs_;
  CudaBuffer<int> crossings_;
  CudaBuffer<int> counts_;
};

extern template class CudaSelf<float>;
extern template class CudaSelf<double>;

}  // namespace atelier
