#include "registration/flattening/grain_direction.h"

#include <Eigen/Eigenvalues>

#include "core/normals.h"

namespace atelier {

Eigen::Matrix<double, 3, 2> face_deformation(const Points& curved, const Triangles& curved_faces,
                                             const Points2& flat, const Triangles& flat_faces,
                                             Index face) {
  Eigen::Matrix<double, 3, 2> edges;
  Eigen::Matrix2d flat_edges;
  for (const int k : {1, 2}) {
    edges.col(k - 1) = curved.row(curved_faces(face, k)) - curved.row(curved_faces(face, 0));
    flat_edges.col(k - 1) = flat.row(flat_faces(face, k)) - flat.row(flat_faces(face, 0));
  }
  return edges * flat_edges.inverse();
}

Eigen::Vector2d grain_direction(const Points& vertices, const Triangles& faces,
                                const Points2& flat) {
  constexpr double kSomewhere = 0.3;  // of the area
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  const Eigen::VectorXd areas = face_areas(vertices, faces);
  for (Index f = 0; f < faces.rows(); ++f) {
    const auto to_curved = face_deformation(vertices, faces, flat, faces, f);
    // Up, where it lies in the face: least squares.
    const Eigen::Vector2d up = (to_curved.transpose() * to_curved).inverse() *
                               to_curved.transpose() * Eigen::Vector3d::UnitY();
    sum += areas[f] * up;
  }
  if (sum.norm() > kSomewhere * areas.sum()) {
    return sum.normalized();
  }
  const Points2 centred = flat.rowwise() - flat.colwise().mean();
  const auto axes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>().computeDirect(centred.transpose() * centred);
  Eigen::Vector2d longest = axes.eigenvectors().col(1);
  if (longest.dot(sum) < 0 || (longest.dot(sum) == 0 && longest.y() < 0)) {
    longest = -longest;
  }
  return longest;
}

Points2 turned_to_grain(const Points& vertices, const Triangles& faces, const Points2& flat) {
  const Eigen::Vector2d grain = grain_direction(vertices, faces, flat);
  Eigen::Matrix2d turn;
  turn << grain.y(), -grain.x(), grain.x(), grain.y();
  return flat * turn.transpose();
}

}  // namespace atelier
