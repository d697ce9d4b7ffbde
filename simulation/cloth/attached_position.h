#pragma once

#include <Eigen/Geometry>

#include "core/garment.h"

namespace atelier {

/// Where a body holds a vertex that is attached to it, m: a place of its triangle, and so far along
/// the triangle's normal.
/// @param body   [N,3] m
/// @param faces  [F,3], more than the attachment's triangle
inline Eigen::Vector3d attached_position(const Attachment& a, const Points& body,
                                         const Triangles& faces) {
  const Eigen::Vector3d p0 = body.row(faces(a.triangle, 0)).transpose();
  const Eigen::Vector3d p1 = body.row(faces(a.triangle, 1)).transpose();
  const Eigen::Vector3d p2 = body.row(faces(a.triangle, 2)).transpose();
  const Eigen::Vector3d normal = (p1 - p0).cross(p2 - p0).normalized();
  return a.barycentric[0] * p0 + a.barycentric[1] * p1 + a.barycentric[2] * p2 +
         a.distance * normal;
}

}  // namespace atelier
