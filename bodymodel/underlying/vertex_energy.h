#pragma once

#include <array>
#include <vector>

#include "core/topology.h"
#include "core/types.h"

namespace atelier {

/// An energy of the vertices x of a mesh that is a sum of squares, for fits of surfaces:
///   sum_e  edge_weights_e |x_i - x_j - edge_vectors_e|^2           edges keep their vectors
/// + sum_v  anchor_weights_v |x_v - anchors_v|^2                    vertices keep to places
/// + sum_r  weight_r rho_r(normal_r . sum_k b_rk x_k - offset_r)    points keep to planes
/// with rho(r) = r^2, or Geman and McClure's r^2 / (1 + r^2 / s^2), which saturates at s^2.

/// One point of the surface and the plane that it is to lie in.
struct PlaneRow {
  std::array<int, 3> vertices{0, 0, 0};
  Eigen::Vector3d barycentric{1, 0, 0};
  Eigen::Vector3d normal{0, 0, 0};  ///< unit length
  double offset = 0;                ///< m along the normal
  double weight = 0;                ///< m2
  double scale = 0;                 ///< s, m; 0: quadratic
};

struct VertexEnergy {
  Edges edges;                     ///< [E,2]
  Eigen::VectorXd edge_weights;    ///< [E] m2
  Points edge_vectors;             ///< [E,3] m, x(first) - x(second)
  Eigen::VectorXd anchor_weights;  ///< [V] m2, >= 0
  Points anchors;                  ///< [V,3] m
  std::vector<PlaneRow> rows;
};

/// Half the cotangents of the two angles that an edge is opposite to, at least 0.05, [E]: what
/// makes the sum over edges the Dirichlet energy of what differs between their ends.
Eigen::VectorXd edge_weights(const Topology& topology, const Points& vertices);

/// The weight with which a row pulls at x, m2: its own, less where it saturates.
double row_weight(const PlaneRow& row, const Points& x);

/// The gradient of its value, [V,3] m3. Throws LogicError for sizes that do not agree or indices
/// out of range.
Points vertex_energy_gradient(const VertexEnergy& energy, const Points& x);

struct VertexMinimumOptions {
  int steps = 2;            ///< Gauss-Newton steps, each with new weights of saturating rows
  int iterations = 100;     ///< of conjugate gradients in each, at most
  double tolerance = 1e-3;  ///< of the residual's norm by the first, where they end
};

/// Vertices of lower energy: Gauss-Newton with the weights of iteratively reweighted least squares,
/// its linear systems solved by conjugate gradients with a sparse Cholesky factor for
/// preconditioner, that of the edges and of the rows as if they pulled alike in all directions: one
/// scalar system instead of three coupled ones, an order of magnitude quicker to factor. Every
/// vertex must be held: by an anchor of positive weight in each piece of the mesh. Runs in one
/// thread; same bits always. O(V^1.5) in practice.
/// Throws LogicError as above, and where the system is singular.
Points lower_vertex_energy(const VertexEnergy& energy, const Points& start,
                           const VertexMinimumOptions& options = {});

}  // namespace atelier
