#include "bodymodel/interpolated_pose.h"

#include "bodymodel/rotation.h"
#include "core/error.h"

namespace atelier {

Eigen::Vector3d interpolated_rotation(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                      double share) {
  const Eigen::Matrix3d from = rotation_matrix(a);
  const Eigen::Vector3d turn = rotation_vector(from.transpose() * rotation_matrix(b));
  return rotation_vector(from * rotation_matrix(share * turn));
}

Pose interpolated_pose(const Pose& a, const Pose& b, double share) {
  ATELIER_CHECK(a.rotations.rows() == b.rotations.rows(), "poses of different skeletons");
  Pose pose;
  pose.root_translation = (1 - share) * a.root_translation + share * b.root_translation;
  pose.rotations.resize(a.rotations.rows(), 3);
  for (Index j = 0; j < a.rotations.rows(); ++j) {
    pose.rotations.row(j) = interpolated_rotation(a.rotations.row(j), b.rotations.row(j), share);
  }
  return pose;
}

}  // namespace atelier
