#include "simulation/xpbd/box_groups.h"

#include "simulation/xpbd/edges_avx2.h"

#if defined(__x86_64__) && defined(__GNUC__)
#define ATELIER_WIDE 1
#include <immintrin.h>
#endif

namespace atelier {
namespace {

unsigned meeting_one(const GroupBounds& group, const Box<float>& box) {
  const float lows[3] = {box.low.x, box.low.y, box.low.z};
  const float highs[3] = {box.high.x, box.high.y, box.high.z};
  unsigned meets = 0;
#ifdef ATELIER_WIDE
  for (int k = 0; k < kGroup; k += 4) {
    __m128 all = _mm_cmpeq_ps(_mm_setzero_ps(), _mm_setzero_ps());
    for (int c = 0; c < 3; ++c) {
      all = _mm_and_ps(all, _mm_cmple_ps(_mm_load_ps(group.low[c] + k), _mm_set1_ps(highs[c])));
      all = _mm_and_ps(all, _mm_cmpge_ps(_mm_load_ps(group.high[c] + k), _mm_set1_ps(lows[c])));
    }
    meets |= static_cast<unsigned>(_mm_movemask_ps(all)) << k;
  }
#else
  for (unsigned k = 0; k < static_cast<unsigned>(kGroup); ++k) {
    bool all = true;
    for (int c = 0; c < 3; ++c) {
      all = all & (group.low[c][k] <= highs[c]) & (group.high[c][k] >= lows[c]);
    }
    meets |= static_cast<unsigned>(all) << k;
  }
#endif
  return meets;
}

#ifdef ATELIER_WIDE

bool wide() {
  static const bool available = avx2_available();
  return available;
}

__attribute__((target("avx2"))) unsigned meeting_wide(const GroupBounds& group,
                                                      const Box<float>& box) {
  const __m256 low[3] = {_mm256_set1_ps(box.low.x), _mm256_set1_ps(box.low.y),
                         _mm256_set1_ps(box.low.z)};
  const __m256 high[3] = {_mm256_set1_ps(box.high.x), _mm256_set1_ps(box.high.y),
                          _mm256_set1_ps(box.high.z)};
  unsigned meets = 0;
  for (int k = 0; k < kGroup; k += kEight) {
    __m256 all = _mm256_cmp_ps(_mm256_load_ps(group.low[0] + k), high[0], _CMP_LE_OQ);
    all = _mm256_and_ps(all, _mm256_cmp_ps(_mm256_load_ps(group.high[0] + k), low[0], _CMP_GE_OQ));
    for (int c = 1; c < 3; ++c) {
      all =
          _mm256_and_ps(all, _mm256_cmp_ps(_mm256_load_ps(group.low[c] + k), high[c], _CMP_LE_OQ));
      all =
          _mm256_and_ps(all, _mm256_cmp_ps(_mm256_load_ps(group.high[c] + k), low[c], _CMP_GE_OQ));
    }
    meets |= static_cast<unsigned>(_mm256_movemask_ps(all)) << k;
  }
  return meets;
}

__attribute__((target("avx2"))) void meeting_wide(const GroupBounds& own, unsigned lanes,
                                                  const GroupBounds& group,
                                                  unsigned (&out)[kGroup]) {
  for (; lanes != 0; lanes &= lanes - 1) {
    const int lane = std::countr_zero(lanes);
    out[lane] = meeting_wide(group, own.at(lane));
  }
}

#else

constexpr bool wide() {
  return false;
}

unsigned meeting_wide(const GroupBounds& group, const Box<float>& box) {
  return meeting_one(group, box);
}
void meeting_wide(const GroupBounds&, unsigned, const GroupBounds&, unsigned (&)[kGroup]) {}

#endif

}  // namespace

unsigned meeting(const GroupBounds& group, const Box<float>& box) {
  return wide() ? meeting_wide(group, box) : meeting_one(group, box);
}

void meeting(const GroupBounds& own, unsigned lanes, const GroupBounds& group,
             unsigned (&out)[kGroup]) {
  if (wide()) {
    meeting_wide(own, lanes, group, out);
    return;
  }
  for (; lanes != 0; lanes &= lanes - 1) {
    const int lane = std::countr_zero(lanes);
    out[lane] = meeting_one(group, own.at(lane));
  }
}

}  // namespace atelier
