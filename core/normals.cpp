#include "core/normals.h"

#include <Eigen/Geometry>
#include <cmath>

#include "core/error.h"
#include "core/points_view.h"

namespace atelier {
namespace {

void check_faces(PointsView vertices, const Triangles& faces) {
  ATELIER_CHECK(faces.rows() == 0 || (faces.minCoeff() >= 0 && faces.maxCoeff() < vertices.rows()),
                "a face names a vertex that is not there");
}

/// Twice the area, along the normal.
Eigen::Vector3d face_vector(PointsView vertices, const Triangles& faces, Index f) {
  const Eigen::Vector3d a = vertices.row(faces(f, 0));
  const Eigen::Vector3d b = vertices.row(faces(f, 1));
  const Eigen::Vector3d c = vertices.row(faces(f, 2));
  return (b - a).cross(c - a);
}

Eigen::Vector3d unit_or_zero(const Eigen::Vector3d& vector) {
  // Scaled first: the squares of a very small face's vector would underflow.
  const double largest = vector.cwiseAbs().maxCoeff();
  return largest > 0 ? (vector / largest).normalized() : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

}  // namespace

Points face_normals(const Points& points, const Triangles& faces) {
  const PointsView vertices = view_of(points);
  check_faces(vertices, faces);
  Points normals(faces.rows(), 3);
  for (Index f = 0; f < faces.rows(); ++f) {
    normals.row(f) = unit_or_zero(face_vector(vertices, faces, f));
  }
  return normals;
}

Eigen::VectorXd face_areas(const Points& points, const Triangles& faces) {
  const PointsView vertices = view_of(points);
  check_faces(vertices, faces);
  Eigen::VectorXd areas(faces.rows());
  for (Index f = 0; f < faces.rows(); ++f) {
    areas[f] = 0.5 * face_vector(vertices, faces, f).norm();
  }
  return areas;
}

Points vertex_normals(const Points& vertices, const Triangles& faces) {
  return vertex_normals(view_of(vertices), faces);
}

Points vertex_normals(PointsView vertices, const Triangles& faces) {
  check_faces(vertices, faces);
  Points normals = Points::Zero(vertices.rows(), 3);
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d normal = unit_or_zero(face_vector(vertices, faces, f));
    if (normal.isZero(0)) {
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d corner = vertices.row(faces(f, k));
      const Eigen::Vector3d u = vertices.row(faces(f, (k + 1) % 3)) - corner.transpose();
      const Eigen::Vector3d v = vertices.row(faces(f, (k + 2) % 3)) - corner.transpose();
      normals.row(faces(f, k)) += std::atan2(u.cross(v).norm(), u.dot(v)) * normal;
    }
  }
  for (Index i = 0; i < normals.rows(); ++i) {
    // Normals that cancel leave rounding, not a direction.
    const Eigen::Vector3d sum = normals.row(i);
    normals.row(i) =
        sum.norm() > 1e-12 ? sum.normalized() : Eigen::Vector3d(Eigen::Vector3d::Zero());
  }
  return normals;
}

Eigen::VectorXd vertex_areas(const Points& vertices, const Triangles& faces) {
  const Eigen::VectorXd areas = face_areas(vertices, faces);
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(vertices.rows());
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      sums[faces(f, k)] += areas[f] / 3;
    }
  }
  return sums;
}

}  // namespace atelier
