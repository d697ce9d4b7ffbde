#include "simulation/projective/panel_products.h"

#include <algorithm>

#include "simulation/xpbd/edges_avx2.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(ATELIER_EXACT)  // exact: no fused ones
#define ATELIER_PANEL_AVX2 __attribute__((target("avx2,fma"), always_inline)) inline
#include <immintrin.h>
#endif

namespace atelier {
namespace {

constexpr int kPanelLanes = 8;

int first_row(int column) {
  return column & ~(kPanelLanes - 1);
}

template <class T>
void add_product_plainly(const FactorPanel<T>& panel, const T* b, T* s) {
  T* const s0 = s;
  T* const s1 = s + panel.lead;
  T* const s2 = s1 + panel.lead;
  for (int k = 0; k < panel.columns; ++k) {
    const T* const p = panel.values + static_cast<std::ptrdiff_t>(k) * panel.lead;
    const T b0 = b[k];
    const T b1 = b[panel.columns + k];
    const T b2 = b[2 * panel.columns + k];
    for (int r = first_row(k); r < panel.lead; ++r) {
      s0[r] += p[r] * b0;
      s1[r] += p[r] * b1;
      s2[r] += p[r] * b2;
    }
  }
}

template <class T>
void transposed_product_plainly(const FactorPanel<T>& panel, const T* s, T* z) {
  for (int k = 0; k < panel.columns; ++k) {
    const T* const p = panel.values + static_cast<std::ptrdiff_t>(k) * panel.lead;
    for (int c = 0; c < 3; ++c) {
      const T* const of = s + static_cast<std::ptrdiff_t>(c) * panel.lead;
      T sum[kPanelLanes] = {};
      for (int r = first_row(k); r < panel.lead; r += kPanelLanes) {
        for (int lane = 0; lane < kPanelLanes; ++lane) {
          sum[lane] += p[r + lane] * of[r + lane];
        }
      }
      T whole = 0;
      for (T lane : sum) {
        whole += lane;
      }
      z[c * panel.columns + k] = whole;
    }
  }
}

#ifdef ATELIER_PANEL_AVX2
bool wide_panels() {
  static const bool available = avx2_available();
  return available;
}

/// Columns [k, k + Columns).
template <int Columns>
ATELIER_PANEL_AVX2 void add_columns(const FactorPanel<float>& panel, int k, const float* b,
                                    float* s) {
  const std::ptrdiff_t lead = panel.lead;
  const float* const p = panel.values + k * lead;
  __m256 factor[3][Columns];
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < Columns; ++j) {
      factor[c][j] = _mm256_set1_ps(b[c * panel.columns + k + j]);
    }
  }
  for (std::ptrdiff_t r = first_row(k); r < lead; r += kPanelLanes) {
    __m256 sum[3];
    for (int c = 0; c < 3; ++c) {
      sum[c] = _mm256_loadu_ps(s + c * lead + r);
    }
    for (int j = 0; j < Columns; ++j) {
      const __m256 column = _mm256_loadu_ps(p + j * lead + r);
      for (int c = 0; c < 3; ++c) {
        sum[c] = _mm256_fmadd_ps(column, factor[c][j], sum[c]);
      }
    }
    for (int c = 0; c < 3; ++c) {
      _mm256_storeu_ps(s + c * lead + r, sum[c]);
    }
  }
}

ATELIER_PANEL_AVX2 float sum_of_lanes(__m256 a) {
  const __m128 four = _mm_add_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
  const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
  return _mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps(two, two, 1)));
}

template <int Columns>
ATELIER_PANEL_AVX2 void transposed_columns(const FactorPanel<float>& panel, int k, const float* s,
                                           float* z) {
  const std::ptrdiff_t lead = panel.lead;
  const float* const p = panel.values + k * lead;
  __m256 sum[3][Columns];
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < Columns; ++j) {
      sum[c][j] = _mm256_setzero_ps();
    }
  }
  for (std::ptrdiff_t r = first_row(k); r < lead; r += kPanelLanes) {
    __m256 of[3];
    for (int c = 0; c < 3; ++c) {
      of[c] = _mm256_loadu_ps(s + c * lead + r);
    }
    for (int j = 0; j < Columns; ++j) {
      const __m256 column = _mm256_loadu_ps(p + j * lead + r);
      for (int c = 0; c < 3; ++c) {
        sum[c][j] = _mm256_fmadd_ps(column, of[c], sum[c][j]);
      }
    }
  }
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < Columns; ++j) {
      z[c * panel.columns + k + j] = sum_of_lanes(sum[c][j]);
    }
  }
}

__attribute__((target("avx2,fma"))) void add_product_avx2(const FactorPanel<float>& panel,
                                                          const float* b, float* s) {
  int k = 0;
  for (; k + 4 <= panel.columns; k += 4) {
    add_columns<4>(panel, k, b, s);
  }
  for (; k < panel.columns; ++k) {
    add_columns<1>(panel, k, b, s);
  }
}

__attribute__((target("avx2,fma"))) void transposed_product_avx2(const FactorPanel<float>& panel,
                                                                 const float* s, float* z) {
  int k = 0;
  for (; k + 4 <= panel.columns; k += 4) {
    transposed_columns<4>(panel, k, s, z);
  }
  for (; k < panel.columns; ++k) {
    transposed_columns<1>(panel, k, s, z);
  }
}
#endif

}  // namespace

void add_product(const FactorPanel<float>& panel, const float* b, float* s) {
#ifdef ATELIER_PANEL_AVX2
  if (wide_panels()) {
    add_product_avx2(panel, b, s);
    return;
  }
#endif
  add_product_plainly(panel, b, s);
}

void add_product(const FactorPanel<double>& panel, const double* b, double* s) {
  add_product_plainly(panel, b, s);
}

void transposed_product(const FactorPanel<float>& panel, const float* s, float* z) {
#ifdef ATELIER_PANEL_AVX2
  if (wide_panels()) {
    transposed_product_avx2(panel, s, z);
    return;
  }
#endif
  transposed_product_plainly(panel, s, z);
}

void transposed_product(const FactorPanel<double>& panel, const double* s, double* z) {
  transposed_product_plainly(panel, s, z);
}

}  // namespace atelier
