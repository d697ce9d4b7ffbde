#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "core/types.h"
#include "simulation/cloth/vec4.h"

namespace atelier {

/// Cholesky factor of a sparse symmetric positive definite matrix, for many solutions of three
/// right hand sides at once; stored as `T`, float or double.
///
/// Unknowns are ordered by nested dissection (George 1973): the particles of a cloth are halved
/// across the longest axis of their box, and what joins the halves comes last. Each part is a front
/// of the multifrontal method (Duff and Reid 1983), kept as one dense panel: with L the factor, J
/// the part's own unknowns and R the later ones that it is joined to, the panel's rows are L_JJ^-1
/// and below them L_RJ L_JJ^-1. So both triangular solutions are a product of the panel, or of its
/// transpose, with a vector per part, from the leaves up and back down. Parts of one depth are
/// solved in parallel, and a part adds up what its halves hand on in their order, so that the bits
/// do not depend on the number of threads.
template <class T>
class CholeskyFactor {
 public:
  /// `positions` [N,3]: of the unknowns, for the order alone. Throws DataError for a matrix that is
  /// not positive definite in double precision.
  CholeskyFactor(const Eigen::SparseMatrix<double>& matrix, const Points& positions);

  /// Solves for three right hand sides in place (the fourth number of each is set to 0).
  void solve(std::vector<Vec4<double>>& x);

  Index size() const { return static_cast<Index>(order_.size()); }
  /// Numbers in the panels, those that are zero included.
  Index stored() const { return static_cast<Index>(values_.size()); }

 private:
  /// A part of the unknowns. Panels are column by column, columns `lead` long.
  struct Part {
    int begin, end;          ///< own unknowns, in the new order
    int row_begin, row_end;  ///< later unknowns that it is joined to, in `rows_`
    int halves[2];           ///< parts, -1: none
    int lead;                ///< rows of the panel, own and later ones, and up to 7 of zeros
    std::size_t panel;       ///< of its first number in `values_`
    std::size_t scratch;     ///< of its first number in `scratch_`: 3 x lead

    int own() const { return end - begin; }
    int later() const { return row_end - row_begin; }
  };
  struct Front;

  void find_rows(const Eigen::SparseMatrix<double>& permuted);
  void factorise(const Eigen::SparseMatrix<double>& permuted);
  void store_panel(const Part& part, const Eigen::MatrixXd& own, const Eigen::MatrixXd& below);
  void solve_up(const Part& part);
  void solve_down(const Part& part);
  /// Calls `work(part)` for all parts, halves before or after what they are halves of.
  template <class Work>
  void visit_up(const Work& work) const;
  template <class Work>
  void visit_down(const Work& work) const;

  std::vector<int> order_;   ///< unknown at each new place
  std::vector<Part> parts_;  ///< halves before what they are halves of
  /// Parts in runs that do not depend on each other: of each run its first and last part plus one.
  /// The first level has whole subtrees, later ones single parts.
  std::vector<std::vector<std::pair<int, int>>> levels_;
  std::vector<int> rows_;  ///< of all parts
  std::vector<int>
      place_in_next_;  ///< of each of `rows_`: in the panel of the part that it hands on to
  std::vector<T> values_;
  std::vector<T> scratch_;   ///< of each part, three times its rows
  std::vector<T> solution_;  ///< 3 x N, in the new order
};

extern template class CholeskyFactor<float>;
extern template class CholeskyFactor<double>;

}  // namespace atelier
