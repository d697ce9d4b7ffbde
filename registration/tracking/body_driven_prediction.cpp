#include "registration/tracking/body_driven_prediction.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/tree.h"

namespace atelier {
namespace {

using Matrix3 = Eigen::Matrix3d;

/// The same by a singular value decomposition, which also bears nearly collinear edges.
Matrix3 nearest_rotation_by_svd(const Matrix3& matrix) {
  const Eigen::JacobiSVD<Matrix3> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()[1] > 1e-9 * svd.singularValues()[0])) {
    return Matrix3::Identity();
  }
  Eigen::Vector3d turn(1, 1, 1);
  turn[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * turn.asDiagonal() * svd.matrixV().transpose();
}

/// The rotation nearest to a matrix; identity where it says nothing. Right singular vectors are
/// eigenvectors of M'M, the left ones of the larger two values are their images, and the third pair
/// completes both to right-handed frames: flat fans of edges have no third value.
Matrix3 nearest_rotation(const Matrix3& matrix) {
  constexpr double kCollinear = 1e-6;  // of the largest eigenvalue
  Eigen::SelfAdjointEigenSolver<Matrix3> eigen;
  eigen.computeDirect(matrix.transpose() * matrix);
  if (!(eigen.eigenvalues()[1] > kCollinear * eigen.eigenvalues()[2])) {
    return nearest_rotation_by_svd(matrix);
  }
  Matrix3 right;
  right.col(0) = eigen.eigenvectors().col(2).normalized();
  right.col(2) = right.col(0).cross(eigen.eigenvectors().col(1)).normalized();
  right.col(1) = right.col(2).cross(right.col(0));
  Matrix3 left;
  left.col(0) = (matrix * right.col(0)).normalized();
  left.col(2) = left.col(0).cross(matrix * right.col(1)).normalized();
  left.col(1) = left.col(2).cross(left.col(0));
  return left * right.transpose();
}

}  // namespace

std::vector<Matrix3> edge_rotations(const Edges& edges, const Eigen::VectorXd& weights,
                                    const Points& from, const Points& to) {
  std::vector<Matrix3> rotations(static_cast<std::size_t>(from.rows()), Matrix3::Zero());
  for (Index e = 0; e < edges.rows(); ++e) {
    const int i = edges(e, 0);
    const int j = edges(e, 1);
    const Matrix3 product =
        weights[e] * (to.row(i) - to.row(j)).transpose() * (from.row(i) - from.row(j));
    rotations[static_cast<std::size_t>(i)] += product;
    rotations[static_cast<std::size_t>(j)] += product;
  }
  parallel_for(from.rows(), 128, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      auto& matrix = rotations[static_cast<std::size_t>(v)];
      matrix = nearest_rotation(matrix);
    }
  });
  return rotations;
}

Points turned_edges(const Edges& edges, const Eigen::VectorXd& weights, const Points& from,
                    const Points& to) {
  const std::vector<Matrix3> rotations = edge_rotations(edges, weights, from, to);
  Points vectors(edges.rows(), 3);
  for (Index e = 0; e < edges.rows(); ++e) {
    const int a = edges(e, 0);
    const int b = edges(e, 1);
    vectors.row(e) =
        0.5 * (from.row(a) - from.row(b)) *
        (rotations[static_cast<std::size_t>(a)] + rotations[static_cast<std::size_t>(b)])
            .transpose();
  }
  return vectors;
}

BodyDrivenCloth body_driven(const Points& cloth, const Triangles& body_faces, const Points& body,
                            const Points& moved_body) {
  ATELIER_CHECK(body.rows() == moved_body.rows(), "bodies of different topologies");
  const Topology topology = topology_of(body_faces, body.rows());
  const std::vector<Matrix3> rotations = edge_rotations(
      topology.edges, Eigen::VectorXd::Ones(topology.edges.rows()), body, moved_body);
  const TriangleTree tree = build_tree(body, body_faces);
  const std::vector<ClosestPoint> closest = closest_points(tree, cloth);
  BodyDrivenCloth driven;
  driven.vertices.resize(cloth.rows(), 3);
  driven.distances.resize(cloth.rows());
  parallel_for(cloth.rows(), 128, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      const ClosestPoint& on = closest[static_cast<std::size_t>(v)];
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      Matrix3 sum = Matrix3::Zero();
      for (int k = 0; k < 3; ++k) {
        const int corner = body_faces(on.face, k);
        point += on.barycentric[k] * moved_body.row(corner).transpose();
        sum += on.barycentric[k] * rotations[static_cast<std::size_t>(corner)];
      }
      const Eigen::Vector3d offset = cloth.row(v).transpose() - on.point;
      driven.vertices.row(v) = (point + nearest_rotation(sum) * offset).transpose();
      driven.distances[v] = std::sqrt(on.squared_distance);
    }
  });
  return driven;
}

Eigen::VectorXd rigid_weights(const ClothModel& model, double length) {
  // In isotropic triangles 2 A_e / L_e^2 is half the sum of both cotangents, and it is never
  // negative.
  return 2 * length * length * model.edge_areas.array() / model.lengths.array().square();
}

Eigen::VectorXd closeness(const BodyDrivenCloth& driven, double near) {
  return (-(driven.distances / near).array().square()).exp();
}

Points predicted_cloth(ShapeSolver& solver, const ClothModel& model, const ClothBefore& before,
                       const PredictOptions& options) {
  constexpr int kRounds = 4;
  const auto& [cloth, driven, home, drift] = before;
  ClothTerms terms;
  terms.edge_weights = rigid_weights(model, options.rigid);
  terms.anchors = driven.vertices;
  const Eigen::VectorXd close = closeness(driven, options.near);
  terms.anchor_weights =
      model.areas.array() * (options.least + (1 - options.least) * close.array());
  for (Index v = 0; v < cloth.rows(); ++v) {
    if (drift.rows() > 0) {
      terms.anchors.row(v) += options.momentum * (1 - close[v]) * drift.row(v);
    }
    if (home.vertices.rows() > 0) {
      const double apart = home.distances[v] / options.near;
      const double share = options.home * close[v] * std::exp(-apart * apart);
      terms.anchors.row(v) += share * (home.vertices.row(v) - terms.anchors.row(v));
    }
  }
  Points x = terms.anchors;
  for (int i = 0; i < kRounds; ++i) {
    terms.edge_vectors = turned_edges(model.topology.edges, terms.edge_weights, cloth, x);
    x = solver.lower(terms, x);
  }
  return x;
}

}  // namespace atelier
