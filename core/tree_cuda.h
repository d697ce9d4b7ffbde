#pragma once

#include <vector>

#include "core/tree.h"

namespace atelier {

/// One ray as kernels take it.
template <class T>
struct TreeRay {
  Vec3<T> origin, direction;
  T t_min, t_max;
};

/// The batch queries of tree.h on the GPU in double precision: tree and queries go there, answers
/// come back. Kernels that keep their tree on the device use CudaTree (tree_cuda.cuh).
/// Throw EnvironmentError where a CUDA call fails.
std::vector<TreePoint<double>> nearest_cuda(const TriangleTree& tree,
                                            const std::vector<Vec3d>& queries,
                                            double max_squared_distance);
std::vector<TreeHit<double>> hits_cuda(const TriangleTree& tree,
                                       const std::vector<TreeRay<double>>& rays, bool any);

}  // namespace atelier
