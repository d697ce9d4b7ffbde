#include "registration/attach_to_body.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/topology.h"
#include "core/tree.h"

namespace atelier {
namespace {

/// A point by its foot on a triangle's plane; `aslant` is how far the foot lies outside of it.
struct Foot {
  Attachment attachment;
  double aslant = std::numeric_limits<double>::infinity();
};

Foot foot_on(const Eigen::Vector3d& point, int triangle, const Points& body,
             const Triangles& faces) {
  Foot foot;
  foot.attachment.triangle = triangle;
  const Eigen::Vector3d a = body.row(faces(triangle, 0)).transpose();
  const Eigen::Vector3d e1 = body.row(faces(triangle, 1)).transpose() - a;
  const Eigen::Vector3d e2 = body.row(faces(triangle, 2)).transpose() - a;
  const Eigen::Vector3d normal = e1.cross(e2);
  const double square = normal.squaredNorm();
  if (!(square > 0)) {
    return foot;
  }
  const Eigen::Vector3d d = point - a;
  Eigen::Vector3d& b = foot.attachment.barycentric;
  b[1] = d.cross(e2).dot(normal) / square;
  b[2] = e1.cross(d).dot(normal) / square;
  b[0] = 1 - b[1] - b[2];
  foot.attachment.distance = d.dot(normal) / std::sqrt(square);
  foot.aslant = b.cwiseMin(0).cwiseAbs().sum();
  if (foot.attachment.distance < 0) {
    foot.aslant += 1;  // a face that looks away from the point
  }
  return foot;
}

}  // namespace

std::vector<Attachment> attach_to_body(const Points& vertices, const Points& body,
                                       const Triangles& body_faces) {
  if (body_faces.rows() == 0) {
    throw DataError("", "body", "no faces", "a surface to ride on");
  }
  const Adjacency fans = vertex_faces(topology_of(body_faces, body.rows()));
  const std::vector<ClosestPoint> nearest = closest_points(build_tree(body, body_faces), vertices);
  std::vector<Attachment> attachments;
  attachments.reserve(nearest.size());
  for (Index v = 0; v < vertices.rows(); ++v) {
    const ClosestPoint& place = nearest[static_cast<std::size_t>(v)];
    const Eigen::Vector3d point = vertices.row(v).transpose();
    Foot best = foot_on(point, place.face, body, body_faces);
    for (int k = 0; k < 3; ++k) {
      for (const int face : fans[body_faces(place.face, k)]) {
        const Foot other = foot_on(point, face, body, body_faces);
        if (other.aslant < best.aslant) {
          best = other;
        }
      }
    }
    if (!std::isfinite(best.aslant)) {  // faces without area: the point of the body alone
      best.attachment.barycentric = place.barycentric;
      best.attachment.distance = 0;
    }
    best.attachment.vertex = static_cast<int>(v);
    attachments.push_back(best.attachment);
  }
  return attachments;
}

Points body_driven(const std::vector<Attachment>& attachments, const Points& body,
                   const Triangles& body_faces) {
  Points points(static_cast<Index>(attachments.size()), 3);
  for (std::size_t i = 0; i < attachments.size(); ++i) {
    const Attachment& attachment = attachments[i];
    ATELIER_CHECK(attachment.triangle >= 0 && attachment.triangle < body_faces.rows(),
                  "a triangle of the body");
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return body.row(body_faces(attachment.triangle, k)).transpose();
    };
    const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    const double length = normal.norm();
    points.row(static_cast<Index>(i)) =
        (attachment.barycentric[0] * corner(0) + attachment.barycentric[1] * corner(1) +
         attachment.barycentric[2] * corner(2) +
         (length > 0 ? attachment.distance / length : 0) * normal)
            .transpose();
  }
  return points;
}

}  // namespace atelier
