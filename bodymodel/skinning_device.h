#pragma once

#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/skinning_math.h"
#include "core/types.h"

namespace atelier {

/// The two sides of the skinning loop; skinning.h chooses between them.
Points skin_linear_cpu(const Points& rest, const SkinWeights& skin,
                       const std::vector<SkinTransform>& transforms);
Points skin_dual_quaternion_cpu(const Points& rest, const SkinWeights& skin,
                                const std::vector<DualQuaternion>& transforms);
Points skin_linear_cuda(const Points& rest, const SkinWeights& skin,
                        const std::vector<SkinTransform>& transforms);
Points skin_dual_quaternion_cuda(const Points& rest, const SkinWeights& skin,
                                 const std::vector<DualQuaternion>& transforms);

}  // namespace atelier
