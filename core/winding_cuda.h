#pragma once

#include <vector>

#include "core/winding_number.h"

namespace atelier {

/// winding_numbers on the GPU: tree and queries go there, numbers come back. Throws
/// EnvironmentError where a CUDA call fails.
std::vector<double> winding_cuda(const WindingTree& tree, const std::vector<Vec3d>& queries,
                                 double accuracy);

}  // namespace atelier
