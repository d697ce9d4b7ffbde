#pragma once

#include <cmath>

#include "core/host_device.h"

namespace atelier {

/// True where the changes of `unknowns` velocities, of squared norm `size`, are more than rounding.
ATELIER_HOST_DEVICE inline bool anderson_usable(double size, double unknowns) {
  constexpr double kRounding = 1e-13;  // m/s, mean of a particle's change
  return size > kRounding * kRounding * unknowns;
}

/// True where changes have grown so much that iterations begin anew.
ATELIER_HOST_DEVICE inline bool anderson_grew(double size, double least) {
  constexpr double kGrowth = 4;  // squared
  return size > kGrowth * least;
}

/// Factor on the diagonal: differences that are nearly combinations of others tell nothing but
/// their rounding.
constexpr double kAndersonRidge = 1 + 1e-6;

/// One thread that works on all rows of a small matrix.
struct AloneInRows {
  template <class Work>
  ATELIER_HOST_DEVICE void rows(int n, const Work& work) const {
    for (int r = 0; r < n; ++r) {
      work(r);
    }
  }
};

/// Solves a symmetric system of `n` unknowns, at most 31, `matrix` [n,n], by elimination with
/// pivots on the diagonal; the solution takes the place of `right` [n], and the matrix is used up.
/// An unknown without a pivot is 0. False where the solution is not finite. `team`: whose threads
/// work on the rows.
template <class Team>
ATELIER_HOST_DEVICE inline bool solve_symmetric(double* matrix, double* right, int n,
                                                const Team& team) {
  constexpr double kNone = 1e-300;
  unsigned left = (1u << n) - 1u;  // unknowns that were no pivot yet
  for (int k = 0; k < n; ++k) {
    int p = -1;
    double most = -1;
    for (int r = 0; r < n; ++r) {
      const double size = std::fabs(matrix[r * n + r]);
      if ((left >> r & 1u) != 0 && (p < 0 || size > most)) {
        p = r;
        most = size;
      }
    }
    left &= ~(1u << p);
    const double inverse = most > kNone ? 1 / matrix[p * n + p] : 0;
    team.rows(n, [&](int r) {
      if (r == p) {
        return;
      }
      const double factor = matrix[r * n + p] * inverse;
      for (int c = 0; c < n; ++c) {
        if ((left >> c & 1u) != 0) {
          matrix[r * n + c] -= factor * matrix[p * n + c];
        }
      }
      right[r] -= factor * right[p];
    });
  }
  team.rows(n, [&](int r) {
    const double pivot = matrix[r * n + r];
    right[r] = std::fabs(pivot) > kNone ? right[r] / pivot : 0;
  });
  bool finite = true;
  for (int r = 0; r < n; ++r) {
    finite = finite && right[r] - right[r] == 0;
  }
  return finite;
}

}  // namespace atelier
