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

/// Factor on the diagonal: differences that are nearly combinations of others tell nothing.
constexpr double kAndersonRidge = 1 + 1e-10;

/// Solves a symmetric system of `n` unknowns, `matrix` [n,n], by elimination with pivots on the
/// diagonal; the solution takes the place of `right` [n], and the matrix is used up. An unknown
/// without a pivot is 0. False where the solution is not finite.
ATELIER_HOST_DEVICE inline bool solve_symmetric(double* matrix, double* right, int n) {
  constexpr int kMost = 32;
  int pivot[kMost];
  const auto at = [&](int r, int c) -> double& { return matrix[r * n + c]; };
  const auto swap = [](double& a, double& b) {
    const double old = a;
    a = b;
    b = old;
  };
  for (int k = 0; k < n; ++k) {
    int p = k;
    for (int i = k + 1; i < n; ++i) {
      p = std::fabs(at(i, i)) > std::fabs(at(p, p)) ? i : p;
    }
    pivot[k] = p;
    if (p != k) {
      for (int c = 0; c < n; ++c) {
        swap(at(k, c), at(p, c));
      }
      for (int r = 0; r < n; ++r) {
        swap(at(r, k), at(r, p));
      }
      swap(right[k], right[p]);
    }
    const double inverse = std::fabs(at(k, k)) > 1e-300 ? 1 / at(k, k) : 0;
    for (int r = k + 1; r < n; ++r) {
      const double factor = at(r, k) * inverse;
      for (int c = k + 1; c < n; ++c) {
        at(r, c) -= factor * at(k, c);
      }
      right[r] -= factor * right[k];
    }
  }
  bool finite = true;
  for (int k = n - 1; k >= 0; --k) {
    double sum = right[k];
    for (int c = k + 1; c < n; ++c) {
      sum -= at(k, c) * right[c];
    }
    right[k] = std::fabs(at(k, k)) > 1e-300 ? sum / at(k, k) : 0;
    finite = finite && right[k] - right[k] == 0;
  }
  for (int k = n - 1; k >= 0; --k) {
    swap(right[k], right[pivot[k]]);
  }
  return finite;
}

}  // namespace atelier
