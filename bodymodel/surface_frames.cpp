#include "bodymodel/surface_frames.h"

#include <Eigen/Geometry>

#include "core/error.h"
#include "core/normals.h"

namespace atelier {

std::vector<Eigen::Matrix3d> surface_frames(const Points& vertices, const Triangles& faces) {
  const Points normals = vertex_normals(vertices, faces);
  std::vector<int> other(static_cast<std::size_t>(vertices.rows()), -1);
  for (Index f = faces.rows() - 1; f >= 0; --f) {
    for (int k = 0; k < 3; ++k) {
      other[static_cast<std::size_t>(faces(f, k))] = faces(f, (k + 1) % 3);
    }
  }
  std::vector<Eigen::Matrix3d> frames(other.size(), Eigen::Matrix3d::Identity());
  for (Index v = 0; v < vertices.rows(); ++v) {
    const int to = other[static_cast<std::size_t>(v)];
    const Eigen::Vector3d normal = normals.row(v).transpose();
    if (to < 0 || normal.squaredNorm() < 0.5) {
      continue;
    }
    Eigen::Vector3d along = (vertices.row(to) - vertices.row(v)).transpose();
    along -= normal.dot(along) * normal;
    const double length = along.norm();
    if (length > 0) {
      auto& frame = frames[static_cast<std::size_t>(v)];
      frame.col(0) = along / length;
      frame.col(1) = normal.cross(along / length);
      frame.col(2) = normal;
    }
  }
  return frames;
}

Points in_surface_frames(const std::vector<Eigen::Matrix3d>& frames, const Points& offsets) {
  ATELIER_CHECK(static_cast<Index>(frames.size()) == offsets.rows(), "offsets of another surface");
  Points turned(offsets.rows(), 3);
  for (Index v = 0; v < offsets.rows(); ++v) {
    turned.row(v) = offsets.row(v) * frames[static_cast<std::size_t>(v)];
  }
  return turned;
}

Points from_surface_frames(const std::vector<Eigen::Matrix3d>& frames, const Points& offsets) {
  ATELIER_CHECK(static_cast<Index>(frames.size()) == offsets.rows(), "offsets of another surface");
  Points turned(offsets.rows(), 3);
  for (Index v = 0; v < offsets.rows(); ++v) {
    turned.row(v) = offsets.row(v) * frames[static_cast<std::size_t>(v)].transpose();
  }
  return turned;
}

}  // namespace atelier
