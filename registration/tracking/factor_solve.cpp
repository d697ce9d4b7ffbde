#include "registration/tracking/factor_solve.h"

#include "registration/tracking/wide_numbers.h"

namespace atelier {
namespace {

[[gnu::always_inline]] inline void solve(const FactorView& factor, FourDoubles* x, Index count) {
  for (Index j = 0; j < count; ++j) {
    const FourDoubles own = x[j];
    for (int k = factor.outer[j]; k < factor.outer[j + 1]; ++k) {
      x[factor.rows[k]] -= factor.values[k] * own;
    }
  }
  for (Index j = count - 1; j >= 0; --j) {
    // Two sums, so that one need not wait for the other.
    FourDoubles sum = x[j] / factor.diagonal[j];
    FourDoubles more = {};
    int k = factor.outer[j];
    for (; k + 1 < factor.outer[j + 1]; k += 2) {
      sum -= factor.values[k] * x[factor.rows[k]];
      more -= factor.values[k + 1] * x[factor.rows[k + 1]];
    }
    if (k < factor.outer[j + 1]) {
      sum -= factor.values[k] * x[factor.rows[k]];
    }
    x[j] = sum + more;
  }
}

ATELIER_AVX2 void solve_avx2(const FactorView& factor, FourDoubles* x, Index count) {
  solve(factor, x, count);
}

void solve_plain(const FactorView& factor, FourDoubles* x, Index count) {
  solve(factor, x, count);
}

}  // namespace

void solve_factor(const FactorView& factor, Eigen::Matrix<double, 4, Eigen::Dynamic>& columns,
                  bool avx2) {
  auto* x = reinterpret_cast<FourDoubles*>(columns.data());
  (avx2 ? solve_avx2 : solve_plain)(factor, x, columns.cols());
}

}  // namespace atelier
