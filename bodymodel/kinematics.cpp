#include "bodymodel/kinematics.h"

#include "bodymodel/rotation.h"
#include "core/error.h"

namespace atelier {
namespace {

Index count(const Skeleton& skeleton) {
  return static_cast<Index>(skeleton.names.size());
}

int parent_of(const Skeleton& skeleton, Index joint) {
  return skeleton.parents[static_cast<std::size_t>(joint)];
}

void check_pose(const Skeleton& skeleton, const Pose& pose) {
  ATELIER_CHECK(pose.rotations.rows() == count(skeleton),
                "pose has " + std::to_string(pose.rotations.rows()) + " rotations, skeleton has " +
                    std::to_string(count(skeleton)) + " joints");
}

// The joint's frame before its own rotation.
Eigen::Matrix3d frame_before(const Skeleton& skeleton, const JointFrames& frames, Index joint) {
  const int parent = parent_of(skeleton, joint);
  Eigen::Matrix3d frame = parent < 0 ? Eigen::Matrix3d::Identity().eval()
                                     : frames.rotations[static_cast<std::size_t>(parent)];
  if (skeleton.rest_rotations.rows() > 0) {
    frame = frame * rotation_matrix(skeleton.rest_rotations.row(joint));
  }
  return frame;
}

}  // namespace

JointFrames forward_kinematics(const Skeleton& skeleton, const Pose& pose) {
  check_pose(skeleton, pose);
  JointFrames frames;
  frames.rotations.resize(skeleton.names.size());
  frames.positions.resize(count(skeleton), 3);
  for (Index j = 0; j < count(skeleton); ++j) {
    const int parent = parent_of(skeleton, j);
    frames.rotations[static_cast<std::size_t>(j)] =
        frame_before(skeleton, frames, j) * rotation_matrix(pose.rotations.row(j));
    if (parent < 0) {
      frames.positions.row(j) = skeleton.offsets.row(j) + pose.root_translation.transpose();
    } else {
      const Eigen::Vector3d offset = skeleton.offsets.row(j);
      frames.positions.row(j) =
          frames.positions.row(parent) +
          (frames.rotations[static_cast<std::size_t>(parent)] * offset).transpose();
    }
  }
  return frames;
}

Pose rest_pose(const Skeleton& skeleton) {
  Pose pose;
  pose.rotations = Points::Zero(count(skeleton), 3);
  return pose;
}

Points rest_positions(const Skeleton& skeleton) {
  return forward_kinematics(skeleton, rest_pose(skeleton)).positions;
}

Index pose_parameter_count(const Skeleton& skeleton) {
  return 3 + 3 * count(skeleton);
}

Eigen::VectorXd pose_vector(const Pose& pose) {
  Eigen::VectorXd values(3 + pose.rotations.size());
  values.head<3>() = pose.root_translation;
  values.tail(pose.rotations.size()) =
      Eigen::Map<const Eigen::VectorXd>(pose.rotations.data(), pose.rotations.size());
  return values;
}

Pose pose_of_vector(const Eigen::VectorXd& values) {
  ATELIER_CHECK(values.size() >= 3 && values.size() % 3 == 0,
                "a pose vector has 3 + 3J values, not " + std::to_string(values.size()));
  Pose pose;
  pose.root_translation = values.head<3>();
  pose.rotations = Eigen::Map<const Points>(values.data() + 3, values.size() / 3 - 1, 3);
  return pose;
}

std::vector<Eigen::Matrix3d> joint_velocity_bases(const Skeleton& skeleton, const Pose& pose,
                                                  const JointFrames& frames) {
  check_pose(skeleton, pose);
  std::vector<Eigen::Matrix3d> bases(skeleton.names.size());
  for (Index j = 0; j < count(skeleton); ++j) {
    bases[static_cast<std::size_t>(j)] =
        frame_before(skeleton, frames, j) * left_jacobian(pose.rotations.row(j));
  }
  return bases;
}

Skeleton shaped_skeleton(const BodyModel& model, const Eigen::VectorXd& shape) {
  check_shape(model, shape);
  Skeleton skeleton = model.skeleton;
  if (shape.size() == 0) {
    return skeleton;
  }
  Points move = Points::Zero(joint_count(model), 3);
  for (Index s = 0; s < shape.size(); ++s) {
    const ShapeParameter& parameter = model.shape[static_cast<std::size_t>(s)];
    move += (shape[s] - parameter.neutral) * parameter.joints;
  }
  const JointFrames rest = forward_kinematics(skeleton, rest_pose(skeleton));
  for (Index j = 0; j < joint_count(model); ++j) {
    const int parent = parent_of(skeleton, j);
    if (parent < 0) {
      skeleton.offsets.row(j) += move.row(j);
    } else {
      skeleton.offsets.row(j) +=
          (move.row(j) - move.row(parent)) * rest.rotations[static_cast<std::size_t>(parent)];
    }
  }
  return skeleton;
}

Eigen::MatrixXd joint_positions_shape_jacobian(const BodyModel& model, const JointFrames& frames) {
  const Index joints = joint_count(model);
  const Index parameters = static_cast<Index>(model.shape.size());
  const JointFrames rest = forward_kinematics(model.skeleton, rest_pose(model.skeleton));
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3 * joints, parameters);
  for (Index j = 0; j < joints; ++j) {
    const int parent = parent_of(model.skeleton, j);
    const std::size_t p = static_cast<std::size_t>(parent);
    for (Index s = 0; s < parameters; ++s) {
      const Points& move = model.shape[static_cast<std::size_t>(s)].joints;
      if (parent < 0) {
        jacobian.block<3, 1>(3 * j, s) = move.row(j).transpose();
      } else {
        jacobian.block<3, 1>(3 * j, s) = jacobian.block<3, 1>(3 * parent, s) +
                                         frames.rotations[p] * rest.rotations[p].transpose() *
                                             (move.row(j) - move.row(parent)).transpose();
      }
    }
  }
  return jacobian;
}

}  // namespace atelier
