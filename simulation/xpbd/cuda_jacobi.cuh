#pragma once

#include "core/cuda_buffer.cuh"
#include "simulation/xpbd/cuda_scene.cuh"
#include "simulation/xpbd/jacobi_math.h"

namespace atelier {

/// Jacobi sweeps on the device (see jacobi_math.h), a launch a step: for comparison, not for speed.
template <class T>
class CudaJacobi {
 public:
  CudaJacobi(const PreparedCloth<T>& prepared, double radius, int scenes);

  /// Sweep `iteration` of a substep over every scene. The frame's multipliers must be there.
  void sweep(const CudaFrame<T>& frame, const std::vector<CudaSceneRule<T>>& rules, int iteration);

 private:
  int scenes_;
  T radius_;
  T weight_ = T(1);
  CudaBuffer<JacobiEdge<T>> edges_;
  CudaBuffer<JacobiTriangle<T>> triangles_;
  CudaBuffer<int> begin_, push_of_;
  CudaBuffer<Vec4<T>> push_, x_before_;  ///< of one scene
  CudaBuffer<EdgeMultipliers<T>> lambda_before_;
  CudaBuffer<T> strain_before_;
};

extern template class CudaJacobi<float>;
extern template class CudaJacobi<double>;

}  // namespace atelier
