#pragma once

#include <Eigen/SparseCore>

#include "core/types.h"

namespace atelier {

/// Differential operators on triangle surfaces, linear finite elements: sparse, column-major.
/// All throw LogicError unless faces name existing vertices and coordinates are finite. O(F log F).

struct LaplacianOptions {
  /// Treatment of faces whose height is below 1e-10 of their longest edge, whose cotangents say
  /// nothing: refuse them with a DataError that names the first, or leave them out, as if there
  /// were a slit. Set it for scans.
  bool skip_degenerate = false;
};

/// Cotangent Laplacian, [V,V] (Pinkall and Polthier, "Computing discrete minimal surfaces and their
/// conjugates", 1993): symmetric, positive semidefinite, rows sum to 0; u' L u is the Dirichlet
/// energy, the integral of |grad u|^2, and mass^-1 L u is minus the Laplace-Beltrami operator of u.
/// Entries have no unit. Obtuse faces make positive entries off the diagonal.
Eigen::SparseMatrix<double> cotangent_laplacian(const Points& vertices, const Triangles& faces,
                                                const LaplacianOptions& options = {});

/// Area that belongs to each vertex, square metres, [V]: the part of its faces that is nearest to
/// it (mixed Voronoi cells; Meyer et al., "Discrete differential-geometry operators for
/// triangulated 2-manifolds", 2003, section 3.3). Sums to the surface's area. The simpler third of
/// each face is vertex_areas (core/normals.h).
Eigen::VectorXd voronoi_areas(const Points& vertices, const Triangles& faces);

}  // namespace atelier
