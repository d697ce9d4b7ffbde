#pragma once

#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/skinning_math.h"
#include "core/types.h"

namespace atelier {

/// The two sides of the skinning loop; skinning.h chooses between them. `vectors` uses AVX2 where
/// the processor has it: same result to rounding, other bits than the scalar path.
Points skin_linear_cpu(const Points& rest, const SkinWeights& skin,
                       const std::vector<SkinTransform>& transforms, bool vectors);
Points skin_dual_quaternion_cpu(const Points& rest, const SkinWeights& skin,
                                const std::vector<DualQuaternion>& transforms);
Points skin_linear_cuda(const Points& rest, const SkinWeights& skin,
                        const std::vector<SkinTransform>& transforms);
Points skin_dual_quaternion_cuda(const Points& rest, const SkinWeights& skin,
                                 const std::vector<DualQuaternion>& transforms);

/// Seconds that one launch of the linear kernel takes with everything in device memory: CUDA events
/// round `repeats` launches after a warm-up. For benchmarks.
double linear_kernel_seconds(const Points& rest, const SkinWeights& skin,
                             const std::vector<SkinTransform>& transforms, int repeats);

#if defined(__x86_64__) && defined(__GNUC__)
/// Whether this processor has what `skin_linear_avx2` uses.
bool has_skin_avx2();

/// Vertices to skin: rows of 3 (rest) and of `slots` (joints, weights).
struct SkinBatch {
  Index count;
  int slots;
  const double* rest;
  const int* joints;
  const double* weights;
};

/// @param skinned  rows of 3
void skin_linear_avx2(const SkinBatch& batch, const SkinTransform* transforms, double* skinned);
#endif

}  // namespace atelier
