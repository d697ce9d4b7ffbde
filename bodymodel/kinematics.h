#pragma once

#include <vector>

#include "bodymodel/body_model.h"
#include "core/pose.h"

namespace atelier {

/// Where every joint is: frame and position in the world. The rest frame's axes come first, then
/// the pose: rotations[j] = rotations[parent] R(rest_rotations[j]) R(pose.rotations[j]).
struct JointFrames {
  std::vector<Eigen::Matrix3d> rotations;  ///< [J] world_from_joint
  Points positions;                        ///< [J,3] metres
};

/// Forward kinematics. positions[j] = positions[parent] + rotations[parent] offsets[j]; the root is
/// at its offset plus the pose's translation. Throws LogicError if the pose has not J rotations.
/// O(J).
JointFrames forward_kinematics(const Skeleton& skeleton, const Pose& pose);

/// All rotations zero: the pose in which a model was made.
Pose rest_pose(const Skeleton& skeleton);

/// Joint positions of the rest pose, [J,3] metres.
Points rest_positions(const Skeleton& skeleton);

/// Number of pose parameters, 3 + 3J: translation, then rotation vectors joint by joint. Every
/// Jacobian in this folder orders its columns so, followed by the S shape values.
Index pose_parameter_count(const Skeleton& skeleton);

/// The pose as one vector [3 + 3J], and back. Throws LogicError on a wrong size.
Eigen::VectorXd pose_vector(const Pose& pose);
Pose pose_of_vector(const Eigen::VectorXd& values);

/// A joint's rotation r moves what hangs on it by the spatial velocity W(r) dr about the joint,
/// W = (frame before the rotation) L(r), L the left Jacobian: W of every joint, [J].
std::vector<Eigen::Matrix3d> joint_velocity_bases(const Skeleton& skeleton, const Pose& pose,
                                                  const JointFrames& frames);

/// The skeleton at a shape: same tree, offsets of the shape's joints. `shape` as in skinning.h.
Skeleton shaped_skeleton(const BodyModel& model, const Eigen::VectorXd& shape = {});

/// Derivative of the joints' world positions by the S shape values, [3J, S].
Eigen::MatrixXd joint_positions_shape_jacobian(const BodyModel& model, const JointFrames& frames);

}  // namespace atelier
