#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "registration/flattening/flatten_panel.h"

namespace atelier {

/// The energy that flatten_panel minimises, and its derivatives: the symmetric Dirichlet energy of
/// a flat shape against a curved one, of cloth that stiffens, and edges' lengths. Unknowns are x0,
/// y0, x1, y1, ... Private to registration.
///
/// A face's energy is 2 + x + b / (n + 1) (x / b)^(n + 1): x is what its symmetric Dirichlet energy
/// has over the 2 of what is not stretched (2 e^2 for a small stretch by e in one direction), b the
/// x of a stretch by `even`, and n is 3. Beyond twice that stretch it goes on straight, so that
/// what cannot be laid flat does not count for all. Lengths are held in proportion to the stiffest.
class PanelEnergy {
 public:
  /// `even` 0: cloth that does not stiffen.
  PanelEnergy(const Points& vertices, const Triangles& faces, std::vector<EdgeLength> lengths,
              double length_weight, double even);

  /// Infinite where a face has no area or is turned over.
  double value(const Eigen::VectorXd& x) const;

  /// The symmetric Dirichlet energy alone.
  double stretching(const Eigen::VectorXd& x) const;

  Eigen::VectorXd gradient(const Eigen::VectorXd& x) const;

  /// The lower half of the Hessian, positive semidefinite (each face's and edge's part is
  /// projected), with a trace of the identity that makes it definite.
  const Eigen::SparseMatrix<double>& hessian(const Eigen::VectorXd& x);

  /// The longest step along d, at most 1, that turns no face over (0.9 of where one would lose its
  /// area).
  double longest_step(const Eigen::VectorXd& x, const Eigen::VectorXd& d) const;

 private:
  using Corners = Eigen::Matrix<double, 2, 3>;
  Corners corners(const Eigen::VectorXd& x, Index face) const;

  /// Symmetric Dirichlet energy of a face; infinite where it has no area or is turned over.
  double dirichlet_at(const Eigen::VectorXd& x, Index face) const;

  /// A face's energy of its symmetric Dirichlet energy `d`, and the first and second derivative.
  struct Stiffened {
    double value, slope, bend;
  };
  Stiffened stiffened(double d) const;

  Triangles faces_;
  std::vector<Eigen::Matrix<double, 3, 2>> gradients_;  ///< corners -> deformation gradient
  Eigen::VectorXd weights_;                             ///< [F] share of the area
  std::vector<EdgeLength> lengths_;
  double length_weight_;
  double soft_;  ///< b
  double area_;
  Eigen::SparseMatrix<double> hessian_;
  std::vector<Eigen::Matrix<int, 6, 6>> face_places_;  ///< into the values of hessian_, or -1
  std::vector<Eigen::Matrix<int, 4, 4>> edge_places_;
  std::vector<int> diagonal_places_;
};

}  // namespace atelier
