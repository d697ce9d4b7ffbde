// Linear blend skinning with AVX2, chosen at run time; compiled to nothing for other processors.
#if defined(__x86_64__) && defined(__GNUC__)

#include <immintrin.h>

#include "bodymodel/skinning_device.h"

namespace atelier {

bool has_skin_avx2() {
  return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
}

// One row of a 3x4 transform is one register: blend the rows of all slots, multiply them by
// (x, y, z, 1) and add across.
__attribute__((target("avx2,fma"))) void skin_linear_avx2(const SkinBatch& batch,
                                                          const SkinTransform* transforms,
                                                          double* skinned) {
  auto [count, slots, rest, joints, weights] = batch;
  const __m256d one = _mm256_set1_pd(1);
  for (Index v = 0; v < count; ++v, rest += 3, skinned += 3, joints += slots, weights += slots) {
    __m256d row0 = _mm256_setzero_pd();
    __m256d row1 = _mm256_setzero_pd();
    __m256d row2 = _mm256_setzero_pd();
    for (int k = 0; k < slots; ++k) {
      const __m256d weight = _mm256_broadcast_sd(weights + k);
      const double* m = transforms[joints[k]].m;
      row0 = _mm256_fmadd_pd(weight, _mm256_loadu_pd(m), row0);
      row1 = _mm256_fmadd_pd(weight, _mm256_loadu_pd(m + 4), row1);
      row2 = _mm256_fmadd_pd(weight, _mm256_loadu_pd(m + 8), row2);
    }
    // The last vertex has no fourth number behind it.
    const __m256d point = v + 1 < count ? _mm256_blend_pd(_mm256_loadu_pd(rest), one, 8)
                                        : _mm256_set_pd(1, rest[2], rest[1], rest[0]);
    const __m256d xy = _mm256_hadd_pd(_mm256_mul_pd(row0, point), _mm256_mul_pd(row1, point));
    const __m256d z = _mm256_mul_pd(row2, point);
    _mm_storeu_pd(skinned, _mm_add_pd(_mm256_castpd256_pd128(xy), _mm256_extractf128_pd(xy, 1)));
    const __m128d z2 = _mm_add_pd(_mm256_castpd256_pd128(z), _mm256_extractf128_pd(z, 1));
    _mm_store_sd(skinned + 2, _mm_add_sd(z2, _mm_unpackhi_pd(z2, z2)));
  }
}

}  // namespace atelier

#endif
