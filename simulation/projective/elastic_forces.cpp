#include <cmath>

#include "core/parallel.h"
#include "simulation/projective/elastic_math.h"
#include "simulation/projective/elastic_rows.h"
#include "simulation/xpbd/edges_avx2.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(ATELIER_EXACT)  // exact: no fused ones
#define ATELIER_FORCES_AVX2 __attribute__((target("avx2,fma"), always_inline)) inline
#include <immintrin.h>
#endif

namespace atelier {
namespace {

constexpr Index kRowGrain = 1024;
constexpr double kShortest = 1e-12;  ///< m, of a spring that has a direction

/// What acts on particles: springs and curvatures from their positions, and rows that are in
/// `of_rows`. A particle's sum is in the order of its lists.
struct ForceTerms {
  const ElasticRows& rows;
  const Vec4<double>* x;
  const Vec4<double>* v;
  const Vec4<double>* of_rows;
};

template <bool kDamped, bool kLimited>
void sum_springs(const ForceTerms& terms, Index i, double* sum) {
  const auto& [rows, x, v, of_rows] = terms;
  const ParticleSprings& springs = rows.springs;
  const double longest = longest_share(rows);
  const double* const at = &x[i].x;
  const double* const speed = &v[i].x;
  for (int e = springs.begin[i]; e < springs.begin[i + 1]; ++e) {
    const double* const other = &x[springs.other[e]].x;
    double d[3];
    for (int k = 0; k < 3; ++k) {
      d[k] = other[k] - at[k];
    }
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (!(length > kShortest)) {
      continue;
    }
    double pull = springs.stiffness[e] * (length - springs.rest[e]);
    if (kLimited) {
      pull += pull_of_limit(springs.limit[e], length, longest * springs.rest[e]);
    }
    if (kDamped) {
      const double* const speed_of_other = &v[springs.other[e]].x;
      double rate = 0;
      for (int k = 0; k < 3; ++k) {
        rate += d[k] * (speed_of_other[k] - speed[k]);
      }
      pull += rows.damping * springs.stiffness[e] * rate / length;
    }
    for (int k = 0; k < 3; ++k) {
      sum[k] += pull / length * d[k];
    }
  }
}

/// Adds curvatures and rows in `of_rows`.
template <bool kDamped>
__attribute__((always_inline)) inline void sum_rows(const ForceTerms& terms, Index i, double* sum) {
  const auto& [rows, x, v, of_rows] = terms;
  for (int e = rows.curvatures.begin[i]; e < rows.curvatures.begin[i + 1]; ++e) {
    const double* const other = &x[rows.curvatures.of[e]].x;
    const double weight = rows.curvatures.weight[e];
    for (int k = 0; k < 4; ++k) {
      sum[k] += weight * other[k];
    }
    if (kDamped) {
      const double* const speed_of_other = &v[rows.curvatures.of[e]].x;
      for (int k = 0; k < 4; ++k) {
        sum[k] += rows.damping * weight * speed_of_other[k];
      }
    }
  }
  for (int e = rows.others.begin[i]; e < rows.others.begin[i + 1]; ++e) {
    const double* const pull = &of_rows[rows.others.of[e]].x;
    const double weight = rows.others.weight[e];
    for (int k = 0; k < 4; ++k) {
      sum[k] += weight * pull[k];
    }
  }
}

template <bool kDamped, bool kLimited>
void sum_forces(const ForceTerms& terms, Index begin, Index end, Vec4<double>* force) {
  for (Index i = begin; i < end; ++i) {
    double sum[4] = {};
    sum_springs<kDamped, kLimited>(terms, i, sum);
    sum_rows<kDamped>(terms, i, sum);
    force[i] = {sum[0], sum[1], sum[2], 0};
  }
}

#ifdef ATELIER_FORCES_AVX2
ATELIER_FORCES_AVX2 __m256d load(const Vec4<double>& a) {
  return _mm256_load_pd(&a.x);
}
/// Four numbers, or those that the mask names.
template <bool kFour>
ATELIER_FORCES_AVX2 __m256d load(const double* a, __m256i mask) {
  return kFour ? _mm256_loadu_pd(a) : _mm256_maskload_pd(a, mask);
}

/// Four vectors' dot products with four others, in one.
ATELIER_FORCES_AVX2 __m256d dots(const __m256d* a, const __m256d* b) {
  const __m256d low = _mm256_hadd_pd(_mm256_mul_pd(a[0], b[0]), _mm256_mul_pd(a[1], b[1]));
  const __m256d high = _mm256_hadd_pd(_mm256_mul_pd(a[2], b[2]), _mm256_mul_pd(a[3], b[3]));
  return _mm256_add_pd(_mm256_permute2f128_pd(low, high, 0x21), _mm256_blend_pd(low, high, 0b1100));
}

/// `count` springs from `e` on of a particle that is `at` a place and has a speed; 4, or fewer:
/// what lacks are springs of the particle `i` to itself, without stiffness.
template <bool kDamped, bool kLimited, bool kFour>
ATELIER_FORCES_AVX2 __m256d add_springs(const ForceTerms& terms, Index i, int e, int count,
                                        __m256d sum) {
  const ElasticRows& rows = terms.rows;
  const ParticleSprings& springs = rows.springs;
  const __m256i is_spring =
      _mm256_cmpgt_epi64(_mm256_set1_epi64x(count), _mm256_setr_epi64x(0, 1, 2, 3));
  Index other[4];
  __m256d d[4];
  const __m256d at = load(terms.x[i]);
  for (int k = 0; k < 4; ++k) {
    other[k] = kFour || k < count ? springs.other[e + k] : i;
    d[k] = _mm256_sub_pd(load(terms.x[other[k]]), at);
  }
  const __m256d length = _mm256_sqrt_pd(dots(d, d));
  const __m256d valid = _mm256_cmp_pd(length, _mm256_set1_pd(kShortest), _CMP_GT_OQ);
  const __m256d inverse = _mm256_and_pd(valid, _mm256_div_pd(_mm256_set1_pd(1), length));
  const __m256d rest = load<kFour>(springs.rest.data() + e, is_spring);
  const __m256d stiffness = load<kFour>(springs.stiffness.data() + e, is_spring);
  __m256d pull = _mm256_mul_pd(stiffness, _mm256_sub_pd(length, rest));
  if (kLimited) {
    const __m256d limit = _mm256_mul_pd(_mm256_set1_pd(longest_share(rows)), rest);
    const __m256d beyond = _mm256_max_pd(_mm256_sub_pd(length, limit), _mm256_setzero_pd());
    pull = _mm256_fmadd_pd(load<kFour>(springs.limit.data() + e, is_spring), beyond, pull);
  }
  if (kDamped) {
    const __m256d speed = load(terms.v[i]);
    __m256d rates[4];
    for (int k = 0; k < 4; ++k) {
      rates[k] = _mm256_sub_pd(load(terms.v[other[k]]), speed);
    }
    const __m256d damped = _mm256_mul_pd(_mm256_set1_pd(rows.damping), stiffness);
    pull = _mm256_fmadd_pd(damped, _mm256_mul_pd(dots(d, rates), inverse), pull);
  }
  const __m256d share = _mm256_mul_pd(pull, inverse);
  sum = _mm256_fmadd_pd(_mm256_permute4x64_pd(share, 0x00), d[0], sum);
  sum = _mm256_fmadd_pd(_mm256_permute4x64_pd(share, 0x55), d[1], sum);
  sum = _mm256_fmadd_pd(_mm256_permute4x64_pd(share, 0xAA), d[2], sum);
  return _mm256_fmadd_pd(_mm256_permute4x64_pd(share, 0xFF), d[3], sum);
}

template <bool kDamped, bool kLimited>
ATELIER_FORCES_AVX2 __m256d sum_springs_avx2(const ForceTerms& terms, Index i) {
  const std::vector<int>& begin = terms.rows.springs.begin;
  __m256d sum = _mm256_setzero_pd();
  int e = begin[i];
  const int last = begin[i + 1];
  for (; e + 4 <= last; e += 4) {
    sum = add_springs<kDamped, kLimited, true>(terms, i, e, 4, sum);
  }
  return e < last ? add_springs<kDamped, kLimited, false>(terms, i, e, last - e, sum) : sum;
}

/// The weighted sum of what a particle's list names of `of`, in two chains.
ATELIER_FORCES_AVX2 __m256d weighted_sum(const ParticleWeights& list, Index i,
                                         const Vec4<double>* of) {
  const int last = list.begin[i + 1];
  __m256d sums[2] = {_mm256_setzero_pd(), _mm256_setzero_pd()};
  int e = list.begin[i];
  for (; e + 2 <= last; e += 2) {
    for (int k = 0; k < 2; ++k) {
      sums[k] =
          _mm256_fmadd_pd(_mm256_set1_pd(list.weight[e + k]), load(of[list.of[e + k]]), sums[k]);
    }
  }
  if (e < last) {
    sums[0] = _mm256_fmadd_pd(_mm256_set1_pd(list.weight[e]), load(of[list.of[e]]), sums[0]);
  }
  return _mm256_add_pd(sums[0], sums[1]);
}

template <bool kDamped, bool kLimited>
__attribute__((target("avx2,fma"))) void sum_forces_avx2(const ForceTerms& terms, Index begin,
                                                         Index end, Vec4<double>* force) {
  const bool curved = !terms.rows.curvatures.of.empty();
  for (Index i = begin; i < end; ++i) {
    __m256d sum = sum_springs_avx2<kDamped, kLimited>(terms, i);
    if (curved) {
      sum = _mm256_add_pd(sum, weighted_sum(terms.rows.curvatures, i, terms.x));
      if (kDamped) {
        const __m256d of_speeds = weighted_sum(terms.rows.curvatures, i, terms.v);
        sum = _mm256_fmadd_pd(_mm256_set1_pd(terms.rows.damping), of_speeds, sum);
      }
    }
    sum = _mm256_add_pd(sum, weighted_sum(terms.rows.others, i, terms.of_rows));
    _mm256_store_pd(&force[i].x, _mm256_blend_pd(sum, _mm256_setzero_pd(), 0b1000));
  }
}
#endif

/// Of bends [begin, end).
void bend_forces_scalar(const ForceTerms& terms, Index begin, Index end, Vec4<double>* pulls) {
  const auto& [rows, x, v, of_rows] = terms;
  for (Index k = begin; k < end; ++k) {
    const ElasticRow& row = rows.rows[rows.bend_begin + k];
    pulls[k] = with_w(bend_force(row, rows.bend_rest[k], rows.damping, x, v), 0.0);
  }
}

#ifdef ATELIER_FORCES_AVX2
ATELIER_FORCES_AVX2 __m256d bend_value(const ElasticRow& row, const Vec4<double>* x) {
  __m256d sum = _mm256_mul_pd(_mm256_set1_pd(row.weight[0]), load(x[row.particle[0]]));
  for (int k = 1; k < 4; ++k) {
    sum = _mm256_fmadd_pd(_mm256_set1_pd(row.weight[k]), load(x[row.particle[k]]), sum);
  }
  return sum;
}

__attribute__((target("avx2,fma"))) void bend_forces_avx2(const ForceTerms& terms, Index begin,
                                                          Index end, Vec4<double>* pulls) {
  const auto& [rows, x, v, of_rows] = terms;
  for (Index k = begin; k < end; ++k) {
    const ElasticRow& row = rows.rows[rows.bend_begin + k];
    if (rows.bend_rest[k] != 0) {
      pulls[k] = with_w(bend_force(row, rows.bend_rest[k], rows.damping, x, v), 0.0);
      continue;
    }
    const __m256d d = bend_value(row, x);
    const __m256d squares = _mm256_mul_pd(d, d);
    const __m256d pairs = _mm256_hadd_pd(squares, squares);
    const __m256d squared = _mm256_add_pd(pairs, _mm256_permute2f128_pd(pairs, pairs, 1));
    const double pull = -row.stiffness * (1 + bend_hardening(_mm256_cvtsd_f64(squared)));
    __m256d sum = _mm256_mul_pd(_mm256_set1_pd(pull), d);
    if (rows.damping > 0) {
      const __m256d damped = _mm256_set1_pd(rows.damping * row.stiffness);
      sum = _mm256_fnmadd_pd(damped, bend_value(row, v), sum);
    }
    _mm256_store_pd(&pulls[k].x, sum);
  }
}
#endif

void bend_forces(const ForceTerms& terms, Index begin, Index end, Vec4<double>* pulls) {
#ifdef ATELIER_FORCES_AVX2
  static const bool wide = avx2_available();
  if (wide) {
    bend_forces_avx2(terms, begin, end, pulls);
    return;
  }
#endif
  bend_forces_scalar(terms, begin, end, pulls);
}

template <bool kDamped, bool kLimited>
auto force_sums() {
#ifdef ATELIER_FORCES_AVX2
  static const bool wide = avx2_available();
  if (wide) {
    return sum_forces_avx2<kDamped, kLimited>;
  }
#endif
  return sum_forces<kDamped, kLimited>;
}

}  // namespace

void elastic_forces(const ElasticRows& rows, const std::vector<Vec4<double>>& x,
                    const std::vector<Vec4<double>>& v, std::vector<Vec4<double>>& of_rows,
                    std::vector<Vec4<double>>& force) {
  parallel_for(rows.yarn_begin - rows.bend_begin, kRowGrain, [&](Index begin, Index end) {
    bend_forces({rows, x.data(), v.data(), nullptr}, begin, end, of_rows.data() + rows.bend_begin);
  });
  const double longest = longest_share(rows);
  const Index triangles = static_cast<Index>(rows.yarn_moduli.size());
  parallel_for(triangles, kRowGrain, [&](Index begin, Index end) {
    for (Index t = begin; t < end; ++t) {
      const Index r = rows.yarn_begin + 2 * t;
      const auto both = [&](const std::vector<Vec4<double>>& of) {
        return Yarns{row_value(rows.rows[r], of.data()), row_value(rows.rows[r + 1], of.data())};
      };
      const Yarns pulls = yarn_forces(rows.yarn_moduli[t], longest, both(x), rows.damping,
                                      rows.damping > 0 ? both(v) : Yarns{});
      of_rows[r] = with_w(pulls.u, 0.0);
      of_rows[r + 1] = with_w(pulls.v, 0.0);
    }
  });
  const auto sum = rows.most_stretch > 0 ? force_sums<true, true>()
                   : rows.damping > 0    ? force_sums<true, false>()
                                         : force_sums<false, false>();
  const ForceTerms terms{rows, x.data(), v.data(), of_rows.data()};
  parallel_for(rows.count, kRowGrain,
               [&](Index begin, Index end) { sum(terms, begin, end, force.data()); });
}

}  // namespace atelier
