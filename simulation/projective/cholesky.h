#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "core/types.h"
#include "simulation/cloth/vec4.h"

namespace atelier {

/// Sparse Cholesky factor of a symmetric positive definite matrix, for many solutions of three
/// right hand sides at once.
///
/// Unknowns are ordered by nested dissection (George 1973): the particles of a cloth are halved
/// across the longest axis of their box, and what joins the halves comes last. Halves are solved
/// in parallel, and a row sums up in the order of its columns, so that the bits do not depend on
/// the number of threads.
class CholeskyFactor {
 public:
  /// `positions` [N,3]: of the unknowns, for the order alone. Throws DataError for a matrix that is
  /// not positive definite in double precision.
  CholeskyFactor(const Eigen::SparseMatrix<double>& matrix, const Points& positions);

  /// Solves for three right hand sides in place (the fourth number of each is not used).
  void solve(std::vector<Vec4<double>>& x);

  Index size() const { return static_cast<Index>(order_.size()); }
  Index nonzeros() const { return static_cast<Index>(row_values_.size()) + size(); }

 private:
  /// Unknowns [begin, end) of the new order that are solved one after the other.
  struct Block {
    int begin, end;
  };

  std::vector<int> order_;                  ///< unknown at each new place
  std::vector<std::vector<Block>> levels_;  ///< blocks that do not depend on each other; halves
                                            ///< first, the block that joins all of them last
  std::vector<int> row_begin_, row_index_;  ///< the factor without its diagonal, by rows
  std::vector<double> row_values_;
  std::vector<int> column_begin_, column_index_;  ///< the same by columns
  std::vector<double> column_values_;
  std::vector<double> inverse_diagonal_;
  std::vector<Vec4<double>> scratch_;
};

}  // namespace atelier
