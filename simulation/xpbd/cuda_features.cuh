#pragma once

#include "core/cuda_buffer.cuh"
#include "simulation/xpbd/cuda_body.cuh"
#include "simulation/xpbd/cuda_scene.cuh"
#include "simulation/xpbd/prepared_features.h"

namespace atelier {

/// Contact with the sharp features of the body on the device: what is sharp in a frame, and which
/// triangles of the cloth may meet it.
template <class T>
class CudaFeatures {
 public:
  CudaFeatures(const Cloth& cloth, const PreparedCloth<T>& prepared,
               const std::vector<FaceIndices>& body_faces, int scenes);

  /// Tells the frame where everything is; its body and body rule are there.
  void describe(CudaFrame<T>& frame);
  /// Begins a frame of `body`, which is refitted, after the outlooks were made.
  void begin_frame(CudaBody<T>& body, CudaFrame<T>& frame, const Vec4<T>* x,
                   const Vec4<T>* velocity);
  /// Forgets pushes that were not applied.
  void reset() { sums_.clear(); }

 private:
  int face_count_;
  int scenes_;
  T longest_ = T(0);
  CudaBuffer<FaceIndices> faces_;
  CudaBuffer<ClothEdge> edges_, body_edges_;
  CudaBuffer<int> across_, ring_begin_, ring_, edge_of_;
  CudaBuffer<T> length_;
  CudaBuffer<int> body_edge_of_, body_corner_of_, body_ring_begin_, body_ring_;
  CudaBuffer<T> min_edge_, least_;
  CudaBuffer<int> sharp_, any_;
  CudaBuffer<BoxNode<T>> nodes_;
  CudaBuffer<int> near_, near_faces_, near_count_, pushed_, pressed_;
  CudaBuffer<ResponseSum> sums_;
};

extern template class CudaFeatures<float>;
extern template class CudaFeatures<double>;

}  // namespace atelier
