#pragma once

#include <Eigen/Core>

#include "core/types.h"

namespace atelier {

/// The factor L D L' of a sparse symmetric matrix, as Eigen's SimplicialLDLT has it: the columns of
/// L below its diagonal, which is 1.
struct FactorView {
  const int* outer = nullptr;        ///< [N+1] where each column begins
  const int* rows = nullptr;         ///< of the entries
  const double* values = nullptr;    ///< of the entries
  const double* diagonal = nullptr;  ///< [N] of D
};

/// Solves L D L' X = B for four right sides at once, so that the factor is read once where Eigen
/// reads it for each. @param columns  [4,N] B', then X'. @param avx2  only where has_avx2()
void solve_factor(const FactorView& factor, Eigen::Matrix<double, 4, Eigen::Dynamic>& columns,
                  bool avx2);

}  // namespace atelier
