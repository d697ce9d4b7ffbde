#pragma once

#include <vector>

#include "core/options.h"
#include "core/types.h"

namespace atelier {

/// How long to look for the flattest shape.
struct FlattenPanelOptions {
  int iterations = 200;      ///< Newton steps at most, 1 to 10000
  double tolerance = 1e-7;   ///< stops where a step lowers the energy by less, share, 0 to 0.1
  double even = 0.015;       ///< stretch beyond which cloth stiffens, 0 to 1; 0: it never does
  bool woven = false;        ///< threads keep their length and faces may shear (woven_shape.h)
  double length_weight = 0;  ///< of `lengths`; 1e3 holds them to about 1e-4 of their length
};
OptionTable describe(FlattenPanelOptions& options);

/// `even` of panels that are to keep below a stretch. Our choice: half of it.
constexpr double stiffening_of(double stretch) {
  return stretch / 2;
}

/// A length that an edge of the flat panel shall have: both sides of a seam the same.
struct EdgeLength {
  int a = 0, b = 0;   ///< vertices
  double length = 0;  ///< m
};

/// A panel laid flat.
struct FlatPanel {
  Points2 vertices;  ///< [V,2] metres; every face is counter-clockwise
  int iterations = 0;
  bool converged = false;
  bool overlaps = false;  ///< it lies over itself: its outline crosses itself
  double energy = 0;      ///< symmetric Dirichlet, a mean over the area; 2 if nothing is stretched
};

/// Lays a panel (a surface that is a disk: one piece, one boundary loop) flat with least stretch.
///
/// Starts from the least squares conformal map (Levy et al., "Least squares conformal maps", 2002)
/// where that turns no face over, else from Tutte's embedding on a disk with mean value weights
/// (Floater, "Mean value coordinates", 2003), which never does. Then minimises the symmetric
/// Dirichlet energy (Smith and Schaefer, "Bijective parameterization with free boundaries", 2015),
/// the mean over the area of (s1^2 + s2^2 + 1/s1^2 + 1/s2^2) / 2 with s1, s2 the principal
/// stretches of flat over curved, by Newton's method, each face's Hessian projected by its analytic
/// eigensystem (Smith, De Goes and Kim, "Analytic eigensystems for isotropic distortion energies",
/// 2019), with a line search that ends before a face would lose its area. So no face is ever turned
/// over. Beyond a stretch of `even` the energy of a face grows with the eighth power of its stretch
/// (panel_energy.h; our choice): what cannot be laid flat without stretch is spread over the panel,
/// where much of it is little, instead of piling up at a few places. `start`, if it has rows, takes
/// the place of the first map. A `woven` panel goes on from there by woven_shape; with a `start` it
/// begins with that.
///
/// Throws DataError for what is no such panel (no face, a vertex that no face uses, several pieces,
/// not a manifold, holes, closed), a number that is not finite, and a triangle without area (height
/// under 1e-7 of its longest edge); LogicError for a `start` that turns a face over. A sparse
/// Cholesky factorisation for each step.
FlatPanel flatten_panel(const Points& vertices, const Triangles& faces,
                        const FlattenPanelOptions& options = {},
                        const std::vector<EdgeLength>& lengths = {}, const Points2& start = {});

}  // namespace atelier
