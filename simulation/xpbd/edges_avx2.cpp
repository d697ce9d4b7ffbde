#include "simulation/xpbd/edges_avx2.h"

#if defined(__x86_64__) && defined(__GNUC__)
#define ATELIER_AVX2 __attribute__((target("avx2,fma"), always_inline)) inline
#include <algorithm>
#include <array>

#include <immintrin.h>

namespace atelier {
namespace {

constexpr int kLanes = 8;

/// Eight vectors, and eight of what Vec4 holds.
struct Lanes3 {
  __m256 x, y, z;
};
struct Lanes4 {
  Lanes3 v;
  __m256 w;
};

ATELIER_AVX2 __m256 all(float value) {
  return _mm256_set1_ps(value);
}
ATELIER_AVX2 Lanes3 minus(const Lanes3& a, const Lanes3& b) {
  return {_mm256_sub_ps(a.x, b.x), _mm256_sub_ps(a.y, b.y), _mm256_sub_ps(a.z, b.z)};
}
ATELIER_AVX2 Lanes3 times(__m256 s, const Lanes3& a) {
  return {_mm256_mul_ps(s, a.x), _mm256_mul_ps(s, a.y), _mm256_mul_ps(s, a.z)};
}
/// a + s b.
ATELIER_AVX2 Lanes3 add_times(const Lanes3& a, __m256 s, const Lanes3& b) {
  return {_mm256_fmadd_ps(s, b.x, a.x), _mm256_fmadd_ps(s, b.y, a.y), _mm256_fmadd_ps(s, b.z, a.z)};
}
ATELIER_AVX2 __m256 dot(const Lanes3& a, const Lanes3& b) {
  return _mm256_fmadd_ps(a.x, b.x, _mm256_fmadd_ps(a.y, b.y, _mm256_mul_ps(a.z, b.z)));
}
ATELIER_AVX2 Lanes3 cross(const Lanes3& a, const Lanes3& b) {
  return {_mm256_fmsub_ps(a.y, b.z, _mm256_mul_ps(a.z, b.y)),
          _mm256_fmsub_ps(a.z, b.x, _mm256_mul_ps(a.x, b.z)),
          _mm256_fmsub_ps(a.x, b.y, _mm256_mul_ps(a.y, b.x))};
}
ATELIER_AVX2 __m256 magnitude(__m256 a) {
  return _mm256_andnot_ps(all(-0.0f), a);
}
ATELIER_AVX2 __m256 above(__m256 a, __m256 b) {
  return _mm256_cmp_ps(a, b, _CMP_GT_OQ);
}

/// Rows of four numbers to columns and back: lane l is row l.
ATELIER_AVX2 void transpose(__m256& a, __m256& b, __m256& c, __m256& d) {
  const __m256 ab0 = _mm256_unpacklo_ps(a, b);
  const __m256 ab1 = _mm256_unpackhi_ps(a, b);
  const __m256 cd0 = _mm256_unpacklo_ps(c, d);
  const __m256 cd1 = _mm256_unpackhi_ps(c, d);
  a = _mm256_shuffle_ps(ab0, cd0, _MM_SHUFFLE(1, 0, 1, 0));
  b = _mm256_shuffle_ps(ab0, cd0, _MM_SHUFFLE(3, 2, 3, 2));
  c = _mm256_shuffle_ps(ab1, cd1, _MM_SHUFFLE(1, 0, 1, 0));
  d = _mm256_shuffle_ps(ab1, cd1, _MM_SHUFFLE(3, 2, 3, 2));
}
ATELIER_AVX2 __m256 two_rows(const float* low, const float* high) {
  return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(low)), _mm_load_ps(high), 1);
}
ATELIER_AVX2 Lanes4 columns(const float* const* row) {
  __m256 a = two_rows(row[0], row[4]);
  __m256 b = two_rows(row[1], row[5]);
  __m256 c = two_rows(row[2], row[6]);
  __m256 d = two_rows(row[3], row[7]);
  transpose(a, b, c, d);
  return {{a, b, c}, d};
}

/// Particles at `corner` of eight edges.
ATELIER_AVX2 Lanes4 gather(const Vec4<float>* x, const Places* edges, int corner) {
  const float* row[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    row[l] = &x[edges[l].at[corner]].x;
  }
  return columns(row);
}
ATELIER_AVX2 void scatter(Vec4<float>* x, const Places* edges, int corner, const Lanes4& p) {
  __m256 a = p.v.x;
  __m256 b = p.v.y;
  __m256 c = p.v.z;
  __m256 d = p.w;
  transpose(a, b, c, d);
  const __m256 rows[4] = {a, b, c, d};
  for (int l = 0; l < 4; ++l) {
    _mm_store_ps(&x[edges[l].at[corner]].x, _mm256_castps256_ps128(rows[l]));
    _mm_store_ps(&x[edges[l + 4].at[corner]].x, _mm256_extractf128_ps(rows[l], 1));
  }
}

/// angle_of for eight.
ATELIER_AVX2 __m256 angle_of(__m256 sine, __m256 cosine) {
  const __m256 as = magnitude(sine);
  const __m256 ac = magnitude(cosine);
  const __m256 big = _mm256_max_ps(as, ac);
  const __m256 small = _mm256_min_ps(as, ac);
  const __m256 z = _mm256_and_ps(_mm256_div_ps(small, big), above(big, _mm256_setzero_ps()));
  const __m256 s = _mm256_mul_ps(z, z);
  __m256 p = all(-0.0040540580f);
  for (const float c : {0.0218612288f, -0.0559098861f, 0.0964200441f, -0.1390853351f, 0.1994653599f,
                        -0.3332985605f, 0.9999993329f}) {
    p = _mm256_fmadd_ps(p, s, all(c));
  }
  __m256 angle = _mm256_mul_ps(z, p);
  angle = _mm256_blendv_ps(angle, _mm256_sub_ps(all(1.57079632679f), angle), above(as, ac));
  angle = _mm256_blendv_ps(angle, _mm256_sub_ps(all(3.14159265359f), angle), cosine);
  return _mm256_xor_ps(angle, _mm256_and_ps(sine, all(-0.0f)));
}

ATELIER_AVX2 __m256 multiplier_change(__m256 c, __m256 weight, __m256 compliance, __m256 lambda,
                                      float gamma, __m256 c_change, __m256 active) {
  __m256 top = _mm256_fmadd_ps(compliance, lambda, c);
  top = _mm256_fmadd_ps(all(gamma), c_change, top);
  const __m256 bottom = _mm256_fmadd_ps(all(1.0f + gamma), weight, compliance);
  const __m256 change = _mm256_div_ps(_mm256_xor_ps(top, all(-0.0f)), bottom);
  return _mm256_and_ps(change, _mm256_and_ps(active, above(weight, _mm256_setzero_ps())));
}

/// Hinges of eight edges; returns the changes of their multipliers.
template <bool kDamped>
ATELIER_AVX2 __m256 project_hinges(Lanes4& p0, Lanes4& p1, Lanes4& p2, Lanes4& p3, __m256 rest,
                                   __m256 compliance, __m256 lambda, __m256 active, float gamma,
                                   const Lanes4* start) {
  const Lanes3 e = minus(p1.v, p0.v);
  const Lanes3 a = minus(p2.v, p0.v);
  const Lanes3 b = minus(p3.v, p0.v);
  const Lanes3 n1 = cross(e, a);
  const Lanes3 n2 = cross(b, e);
  const __m256 ee = dot(e, e);
  const __m256 nn1 = dot(n1, n1);
  const __m256 nn2 = dot(n2, n2);
  const __m256 tiny = _mm256_mul_ps(all(1e-12f), _mm256_mul_ps(ee, ee));
  active = _mm256_and_ps(active, _mm256_and_ps(above(nn1, tiny), above(nn2, tiny)));
  const __m256 length = _mm256_sqrt_ps(ee);
  const __m256 inverse = _mm256_div_ps(all(1.0f), length);
  const __m256 angle = angle_of(_mm256_mul_ps(dot(cross(n1, n2), e), inverse), dot(n1, n2));
  const Lanes3 u1 = times(_mm256_div_ps(all(1.0f), nn1), n1);
  const Lanes3 u2 = times(_mm256_div_ps(all(1.0f), nn2), n2);
  const __m256 s2 = _mm256_mul_ps(dot(a, e), inverse);
  const __m256 s3 = _mm256_mul_ps(dot(b, e), inverse);
  const __m256 back = _mm256_xor_ps(length, all(-0.0f));
  const Lanes3 g2 = times(back, u1);
  const Lanes3 g3 = times(back, u2);
  const Lanes3 g0 = add_times(times(_mm256_sub_ps(length, s2), u1), _mm256_sub_ps(length, s3), u2);
  const Lanes3 g1 = add_times(times(s2, u1), s3, u2);
  __m256 weight = _mm256_mul_ps(p0.w, dot(g0, g0));
  weight = _mm256_fmadd_ps(p1.w, dot(g1, g1), weight);
  weight = _mm256_fmadd_ps(p2.w, dot(g2, g2), weight);
  weight = _mm256_fmadd_ps(p3.w, dot(g3, g3), weight);
  __m256 c_change = _mm256_setzero_ps();
  if constexpr (kDamped) {
    c_change = _mm256_add_ps(
        _mm256_add_ps(dot(g0, minus(p0.v, start[0].v)), dot(g1, minus(p1.v, start[1].v))),
        _mm256_add_ps(dot(g2, minus(p2.v, start[2].v)), dot(g3, minus(p3.v, start[3].v))));
  }
  __m256 c = _mm256_sub_ps(angle, rest);
  const __m256 turn = all(6.28318530718f);
  const __m256 half = all(3.14159265359f);
  c = _mm256_sub_ps(c, _mm256_and_ps(turn, above(c, half)));
  c = _mm256_add_ps(c, _mm256_and_ps(turn, above(_mm256_xor_ps(half, all(-0.0f)), c)));
  const __m256 change = multiplier_change(c, weight, compliance, lambda, gamma, c_change, active);
  p0.v = add_times(p0.v, _mm256_mul_ps(p0.w, change), g0);
  p1.v = add_times(p1.v, _mm256_mul_ps(p1.w, change), g1);
  p2.v = add_times(p2.v, _mm256_mul_ps(p2.w, change), g2);
  p3.v = add_times(p3.v, _mm256_mul_ps(p3.w, change), g3);
  return change;
}

template <bool kDamped>
ATELIER_AVX2 __m256 project_springs(Lanes4& a, Lanes4& b, __m256 rest, __m256 compliance,
                                    __m256 lambda, __m256 active, float gamma,
                                    const Lanes4* start) {
  const Lanes3 d = minus(a.v, b.v);
  const __m256 squared = dot(d, d);
  const __m256 length = _mm256_sqrt_ps(squared);
  // A spring of no length has no direction.
  const __m256 inverse =
      _mm256_and_ps(_mm256_div_ps(all(1.0f), length), above(squared, all(1e-24f)));
  const Lanes3 g = times(inverse, d);
  const __m256 weight = _mm256_mul_ps(_mm256_add_ps(a.w, b.w), dot(g, g));
  __m256 c_change = _mm256_setzero_ps();
  if constexpr (kDamped) {
    c_change = dot(g, minus(minus(a.v, start[0].v), minus(b.v, start[1].v)));
  }
  const __m256 c = _mm256_sub_ps(_mm256_mul_ps(squared, inverse), rest);
  const __m256 change = multiplier_change(c, weight, compliance, lambda, gamma, c_change, active);
  a.v = add_times(a.v, _mm256_mul_ps(a.w, change), g);
  b.v = add_times(b.v, _mm256_mul_ps(b.w, _mm256_xor_ps(change, all(-0.0f))), g);
  return change;
}

/// Undoes what a shuffle within halves did to the order of pairs.
ATELIER_AVX2 __m256 in_order(__m256 v) {
  return _mm256_castpd_ps(_mm256_permute4x64_pd(_mm256_castps_pd(v), _MM_SHUFFLE(3, 1, 2, 0)));
}

/// Eight edges, all with hinges or none.
template <bool kHinges, bool kDamped>
ATELIER_AVX2 void project_eight(const Places* edges, const EdgeRule<float>* rules,
                                EdgeMultipliers<float>* lambda, Vec4<float>* x,
                                const Vec4<float>* start, const SubstepScale<float>& scale) {
  constexpr int kCorners = kHinges ? 4 : 2;
  const float* row[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    row[l] = &rules[l].rest_angle;
  }
  const Lanes4 rule = columns(row);
  Lanes4 p[kCorners];
  Lanes4 before[kCorners];
  for (int corner = 0; corner < kCorners; ++corner) {
    p[corner] = gather(x, edges, corner);
    if constexpr (kDamped) {
      before[corner] = gather(start, edges, corner);
    }
  }
  // Multipliers come as hinge, spring, hinge, spring, ...
  const __m256 low = _mm256_loadu_ps(&lambda[0].hinge);
  const __m256 high = _mm256_loadu_ps(&lambda[4].hinge);
  __m256 hinge = in_order(_mm256_shuffle_ps(low, high, _MM_SHUFFLE(2, 0, 2, 0)));
  __m256 spring = in_order(_mm256_shuffle_ps(low, high, _MM_SHUFFLE(3, 1, 3, 1)));
  const __m256 zero = _mm256_setzero_ps();
  if constexpr (kHinges) {
    const __m256 has = _mm256_cmp_ps(rule.v.y, zero, _CMP_GE_OQ);
    hinge = _mm256_add_ps(hinge, project_hinges<kDamped>(p[0], p[1], p[2], p[3], rule.v.x,
                                                         _mm256_mul_ps(rule.v.y, all(scale.hinge)),
                                                         hinge, has, scale.gamma, before));
  }
  const __m256 has = _mm256_cmp_ps(rule.w, zero, _CMP_GE_OQ);
  spring = _mm256_add_ps(spring, project_springs<kDamped>(p[0], p[1], rule.v.z,
                                                          _mm256_mul_ps(rule.w, all(scale.spring)),
                                                          spring, has, scale.gamma, before));
  for (int corner = 0; corner < kCorners; ++corner) {
    scatter(x, edges, corner, p[corner]);
  }
  const __m256 first = _mm256_unpacklo_ps(hinge, spring);
  const __m256 second = _mm256_unpackhi_ps(hinge, spring);
  _mm256_storeu_ps(&lambda[0].hinge, _mm256_permute2f128_ps(first, second, 0x20));
  _mm256_storeu_ps(&lambda[4].hinge, _mm256_permute2f128_ps(first, second, 0x31));
}

template <bool kHinges, bool kDamped>
__attribute__((target("avx2,fma"))) void project_run(const EdgeRun& run,
                                                     const PatchParticles& particles,
                                                     const SubstepScale<float>& scale) {
  const auto [edges, rules, lambda, begin, end] = run;
  const auto [x, start, spare] = particles;
  int e = begin;
  for (; e + kLanes <= end; e += kLanes) {
    project_eight<kHinges, kDamped>(edges + e, rules + e, lambda + e, x, start, scale);
  }
  if (e == end) {
    return;
  }
  const std::uint16_t nobody = static_cast<std::uint16_t>(spare);
  std::array<Places, kLanes> last_edges;
  std::array<EdgeRule<float>, kLanes> last_rules;
  std::array<EdgeMultipliers<float>, kLanes> last_lambda{};
  last_edges.fill({{nobody, nobody, nobody, nobody}});
  last_rules.fill({0, -1, 0, -1});
  std::copy(edges + e, edges + end, last_edges.begin());
  std::copy(rules + e, rules + end, last_rules.begin());
  std::copy(lambda + e, lambda + end, last_lambda.begin());
  project_eight<kHinges, kDamped>(last_edges.data(), last_rules.data(), last_lambda.data(), x,
                                  start, scale);
  std::copy(last_lambda.begin(), last_lambda.begin() + (end - e), lambda + e);
}

}  // namespace

bool avx2_available() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}

void project_edges_avx2(const EdgeRun& run, const PatchParticles& particles,
                        const SubstepScale<float>& scale) {
  particles.x[particles.spare] = {0, 0, 0, 0};
  // Edges with hinges come first in a colour.
  const EdgeRule<float>* const middle =
      std::partition_point(run.rules + run.begin, run.rules + run.end,
                           [](const EdgeRule<float>& rule) { return rule.hinge_compliance >= 0; });
  EdgeRun with_hinges = run;
  EdgeRun without = run;
  with_hinges.end = without.begin = static_cast<int>(middle - run.rules);
  if (scale.gamma > 0) {
    particles.start[particles.spare] = {0, 0, 0, 0};
    project_run<true, true>(with_hinges, particles, scale);
    project_run<false, true>(without, particles, scale);
  } else {
    project_run<true, false>(with_hinges, particles, scale);
    project_run<false, false>(without, particles, scale);
  }
}

}  // namespace atelier

#else

#include "core/error.h"

namespace atelier {

bool avx2_available() {
  return false;
}

void project_edges_avx2(const EdgeRun&, const PatchParticles&, const SubstepScale<float>&) {
  throw LogicError("AVX2 code on a processor of another kind");
}

}  // namespace atelier

#endif
