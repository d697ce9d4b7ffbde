#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "core/types.h"

namespace atelier {

/// The inverse W = L^-1 of the sparse Cholesky factor of a symmetric positive definite matrix
/// A = L L^T, for devices on which a triangular solution waits for itself too often: A^-1 b is
/// W^T (W b), two products.
///
/// With the unknowns ordered by nested dissection (George 1973) column j of W has entries only in
/// the part of j and in the separators around it, so a grid of n unknowns has O(n^1.5) of them. A
/// row of W spans the part's halves and the part itself, which follow one another in the order: it
/// is stored as one run of numbers, without indices.
class InverseFactor {
 public:
  /// Unknowns [begin, end) of the order, a separator or what is not halved any more; [first, begin)
  /// are its halves. Rows of W lie one after the other from `offset` on, `stride` numbers each,
  /// from column `column` on, which is `first` rounded down to kAlign.
  struct Part {
    int first, begin, end;
    int parent;  ///< the separator that it is a half of, -1: none
    int column, stride;
    std::int64_t offset;

    std::int64_t row(int i) const { return offset + static_cast<std::int64_t>(i - begin) * stride; }
  };
  /// Rows begin at multiples of it and have multiples of it as lengths: 32 bytes in float.
  static constexpr int kAlign = 8;

  /// `positions` [N,3]: of the unknowns, for the order alone. Throws DataError for a matrix that is
  /// not positive definite in double precision. The same bits on any number of threads.
  InverseFactor(const Eigen::SparseMatrix<double>& matrix, const Points& positions);

  int size() const { return static_cast<int>(order_.size()); }
  const std::vector<int>& order() const { return order_; }       ///< unknown at each place
  const std::vector<Part>& parts() const { return parts_; }      ///< halves before their separator
  const std::vector<double>& values() const { return values_; }  ///< of W, 0 outside of it

 private:
  void fill(const Eigen::SparseMatrix<double, Eigen::RowMajor>& lower);

  std::vector<int> order_;
  std::vector<Part> parts_;
  std::vector<double> values_;
};

/// True where numbers of W may be rounded to half precision, each row scaled by a power of two of
/// its own: no diagonal of `matrix` is more than 1e5 times the unknown's mass. In the energy of the
/// matrix, products with them are within 4% of the inverse's then (0.2% at 1e3, 1% at 1e4, measured
/// on grids): iterations mend that as they mend what is not linear. Our choice.
/// @param matrix  M + h^2 K of the unknowns
/// @param mass    [unknowns] kg, above 0
bool half_precision_serves(const Eigen::SparseMatrix<double>& matrix,
                           const std::vector<double>& mass);

}  // namespace atelier
