#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "simulation/cloth/cloth.h"
#include "simulation/cloth/vec4.h"

namespace atelier {

/// The elastic energy of a cloth as projective dynamics has it (Bouaziz et al. 2014): a sum of
/// 1/2 k |a x - p|^2 over rows a, each a weighted sum of up to four particles, where the projection
/// p is what the row would be at rest and the direction that it has now:
///
/// - spring: a x = x_a - x_b, p of the rest length along it. Energy 1/2 k (length - rest)^2.
/// - bend: a x = u_l + u_r, with u the vector from the edge to the corner across it over its
/// height,
///   in the flat rest shape: 2 sin(angle / 2) long, 0 where the rest shape is only moved or
///   stretched (mean curvature, Bergou et al. 2006, with the weights of the cloth's hinges). p is
///   beyond 0, by so much that the force is that of the angle; for a rest angle along the normal.
/// - yarn: two rows a triangle, the deformation gradient along weft and warp; p of length 1 along
///   it, and the force of the angle between both.
///
/// Projection and gradient agree: k (p - a x) is the force of the row. So energies and equilibria
/// are those of XPBD's springs and triangles, and of its hinges up to the seventh power of the
/// angle: 2% less at a right angle.
struct ElasticRow {
  std::array<int, 4> particle{-1, -1, -1, -1};  ///< -1: none
  std::array<double, 4> weight{};               ///< the row's coefficients
  double stiffness = 0;                         ///< k in the constant matrix
  double limit = 0;  ///< what adds to k beyond the limit of stretch, or where it is folded
};

/// The springs of each particle: of particle i those from begin[i] to begin[i + 1], with the one at
/// the other end. So each is there twice, and a particle sums up its own.
struct ParticleSprings {
  std::vector<int> begin;  ///< [V + 1]
  std::vector<int> other, row;
  std::vector<double> rest, stiffness;
  std::vector<double> limit;  ///< stiffness that comes in addition beyond the limit
};

/// Weights of other particles and of rows in what acts on each particle.
struct ParticleWeights {
  std::vector<int> begin;  ///< [V + 1]
  std::vector<int> of;     ///< a particle, or a row
  std::vector<double> weight;
};

struct ElasticRows {
  int count = 0;                    ///< particles
  std::vector<ElasticRow> rows;     ///< springs, then bends, then two of each triangle
  std::vector<double> spring_rest;  ///< [springs] m
  std::vector<double> bend_rest;    ///< [bends] 2 sin(rest angle / 2)
  std::vector<std::array<double, 3>>
      yarn_moduli;                     ///< [triangles] warp, weft, shear times area, N m
  int bend_begin = 0, yarn_begin = 0;  ///< first row of each kind
  double damping = 0;                  ///< s, stiffness-proportional
  double most_stretch = 0;  ///< share of the rest length from which `limit` adds; 0: none

  // The same as forces are evaluated.
  ParticleSprings springs;
  ParticleWeights curvatures;  ///< force is sum weight (x + damping v)
  ParticleWeights others;      ///< rows of bends and of triangles
};

/// Springs and yarns are so many times stiffer beyond the limit of their stretch.
constexpr double kLimitStiffness = 30;

/// Rows of a cloth over its particles; `internal`: the particle of each vertex. `most_stretch`: the
/// limit of springs and yarns, as a share of their rest length; 0: none.
ElasticRows make_elastic_rows(const Cloth& cloth, const std::vector<int>& internal,
                              double most_stretch = 0);

/// Length from which limits of stretch add, as a share of that at rest; infinite: none.
double longest_share(const ElasticRows& rows);

/// Forces of all rows at positions `x` and velocities `v`: `of_rows` [rows] as scratch, `force` [V]
/// in N. The same bits on any number of threads.
void elastic_forces(const ElasticRows& rows, const std::vector<Vec4<double>>& x,
                    const std::vector<Vec4<double>>& v, std::vector<Vec4<double>>& of_rows,
                    std::vector<Vec4<double>>& force);

/// M + h^2 A^T K A (with damping h (h + damping)) over the free particles: `place` [V] is each
/// one's place among them, -1 for a fixed one. Lower and upper part.
Eigen::SparseMatrix<double> projective_matrix(const ElasticRows& rows,
                                              const std::vector<double>& mass,
                                              const std::vector<int>& place, int free_count,
                                              double h);

}  // namespace atelier
