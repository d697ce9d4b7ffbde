#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "core/topology.h"

namespace atelier {

/// The energy of a garment's vertices x that registration minimises, per area of cloth in m2 times
/// squared distances in m2:
///   sum_e  stretch (or compress) A_e (l_e / L_e - 1)^2      cloth keeps its lengths
/// + sum_h  bend |sum_k c_hk x_k|^2 / A_h                     and bends little
/// + sum_e  edge_weights_e |x_i - x_j - edge_vectors_e|^2     edges keep their vectors
/// + sum_v  anchor_weights_v |x_v - anchors_v|^2              vertices keep to places
/// + sum_r  weight_r rho_r(normal_r . sum_k b_rk x_k - offset_r)   points keep to planes
/// + sum_f  d' H_f d + 2 g_f' d,  d = corners - origin        what images say of each face
/// with rho(r) = r^2, or Geman and McClure's r^2 / (1 + r^2 / s^2), which saturates at s^2.
/// Bending is the quadratic form of isometric deformations (Bergou et al., "A quadratic bending
/// model for inextensible surfaces", SGP 2006), about bend times the integral of the squared
/// curvature.

/// The part that is the same in all frames.
struct ClothModel {
  Topology topology;
  Eigen::VectorXd lengths;     ///< [E] m, at rest
  Eigen::VectorXd edge_areas;  ///< [E] m2, a third of each face at the edge
  Eigen::VectorXd areas;       ///< [V] m2, a third of each face at the vertex
  Eigen::Matrix<int, Eigen::Dynamic, 4, Eigen::RowMajor> hinges;  ///< [H,4] edge's ends, apexes
  Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> hinge_weights;  ///< [H,4] c, scaled by
                                                                            ///< sqrt(1 / A_h), 1/m
  std::vector<char> goes_on;  ///< [V] 1 at a rim where the garment does not end, but goes on under
                              ///< another; or empty
};

/// Throws DataError (with `file`) for a mesh without faces, one that is no manifold, faces without
/// area, or vertices without a face.
ClothModel cloth_model(const Points& vertices, const Triangles& faces,
                       const std::string& file = "");

/// One point of the surface and the plane that it is to lie in.
struct SurfaceRow {
  std::array<int, 3> vertices{0, 0, 0};  ///< of one face, or one vertex three times
  Eigen::Vector3d barycentric{1, 0, 0};
  Eigen::Vector3d normal{0, 0, 0};  ///< unit length
  double offset = 0;                ///< m along the normal
  double weight = 0;                ///< m2
  double scale = 0;                 ///< s, m; 0: quadratic
};

/// A quadratic function of one face's corners (x0 y0 z0 x1 ...).
struct FaceQuadratic {
  int face = 0;
  Eigen::Matrix<double, 9, 9> H = Eigen::Matrix<double, 9, 9>::Zero();  ///< m2
  Eigen::Matrix<double, 9, 1> g = Eigen::Matrix<double, 9, 1>::Zero();  ///< m3
};

struct ClothTerms {
  double stretch = 0;                     ///< m2, of edges longer than at rest
  double compress = 0;                    ///< m2, of shorter ones
  double bend = 0;                        ///< m4
  Eigen::VectorXd edge_weights;           ///< [E] m2, or empty
  Points edge_vectors;                    ///< [E,3] m, x(first) - x(second)
  Eigen::VectorXd anchor_weights;         ///< [V] m2, or empty
  Points anchors;                         ///< [V,3] m
  std::vector<SurfaceRow> rows;           ///< what the scan and the body say
  std::vector<FaceQuadratic> quadratics;  ///< what images say
  Points origin;                          ///< [V,3] m, where the quadratics were made; or empty
};

/// The weight with which a row pulls at x, m2: its own, less where it saturates.
double row_weight(const SurfaceRow& row, const Points& x);

/// Value, m4, and gradient, [V,3] m3. Throw LogicError for sizes that do not agree.
double cloth_energy(const ClothModel& model, const ClothTerms& terms, const Points& x);
Points cloth_energy_gradient(const ClothModel& model, const ClothTerms& terms, const Points& x);

/// Gauss-Newton steps down a cloth's energy. Their systems are solved by conjugate gradients with a
/// sparse Cholesky factor for preconditioner: that of one scalar a pair of vertices, the mean of
/// their block's diagonal, which is six times quicker than a factor of the whole. The symbolic half
/// is made once. One thread, the same bits always.
class ShapeSolver {
 public:
  /// `model` must outlive it. Throws LogicError where an edge has no length at rest.
  explicit ShapeSolver(const ClothModel& model);
  ~ShapeSolver();
  ShapeSolver(ShapeSolver&&) noexcept;
  ShapeSolver& operator=(ShapeSolver&&) noexcept;

  /// The lower half of the matrix of a step: J'J of every term, [3V,3V] m2, with weights of
  /// saturating rows as they are at x, and where an edge is too long also what keeps it from
  /// turning.
  const Eigen::SparseMatrix<double>& matrix(const ClothTerms& terms, const Points& x);

  /// Vertices of lower energy: one step, halved until the energy falls; x itself where it does not.
  /// Throws LogicError where the energy at x is no number.
  Points lower(const ClothTerms& terms, const Points& x);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace atelier
