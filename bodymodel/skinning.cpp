#include "bodymodel/skinning.h"

#include <algorithm>

#include "bodymodel/rotation.h"
#include "bodymodel/skinning_device.h"
#include "core/error.h"

namespace atelier {
namespace {

void add_scaled(const Blendshape& shape, double scale, Points& vertices) {
  if (shape.vertices.empty()) {
    vertices += scale * shape.offsets;
    return;
  }
  for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
    vertices.row(shape.vertices[i]) += scale * shape.offsets.row(static_cast<Index>(i));
  }
}

void check_pose(const BodyModel& model, const Pose& pose) {
  ATELIER_CHECK(pose.rotations.rows() == joint_count(model),
                "pose has " + std::to_string(pose.rotations.rows()) +
                    " rotations, body model has " + std::to_string(joint_count(model)) + " joints");
}

// How far the quaternion leans to the bending side; see PoseFeature::Bend.
double bend_lean(const PoseCorrective& corrective, const Eigen::Vector3d& r) {
  return std::max(0.0, quaternion_of(r).head<3>().dot(corrective.axis));
}

}  // namespace

ShapedBody shape_body(const BodyModel& model, const Eigen::VectorXd& shape) {
  check_shape(model, shape);
  ShapedBody body;
  body.skeleton = shaped_skeleton(model, shape);
  body.vertices = model.mesh.vertices;
  for (Index s = 0; s < shape.size(); ++s) {
    const ShapeParameter& parameter = model.shape[static_cast<std::size_t>(s)];
    if (shape[s] != parameter.neutral) {
      add_scaled(parameter.surface, shape[s] - parameter.neutral, body.vertices);
    }
  }
  const JointFrames rest = forward_kinematics(body.skeleton, rest_pose(body.skeleton));
  body.joints = rest.positions;
  body.rest_rotations = rest.rotations;
  return body;
}

BodyModel at_shape(const BodyModel& model, const Eigen::VectorXd& shape) {
  ShapedBody body = shape_body(model, shape);
  BodyModel result = model;
  result.mesh.vertices = std::move(body.vertices);
  result.skeleton = std::move(body.skeleton);
  for (Index s = 0; s < shape.size(); ++s) {
    ShapeParameter& parameter = result.shape[static_cast<std::size_t>(s)];
    parameter.neutral = shape[s];
    parameter.min = std::min(parameter.min, shape[s]);
    parameter.max = std::max(parameter.max, shape[s]);
  }
  return result;
}

Eigen::VectorXd pose_features(const BodyModel& model, const Pose& pose) {
  check_pose(model, pose);
  Eigen::VectorXd features(static_cast<Index>(model.correctives.size()));
  int joint = -1;
  Eigen::Matrix3d rotation;
  for (Index c = 0; c < features.size(); ++c) {
    const PoseCorrective& corrective = model.correctives[static_cast<std::size_t>(c)];
    const Eigen::Vector3d r = pose.rotations.row(corrective.joint);
    switch (corrective.feature) {
      case PoseFeature::RotationEntry: {
        if (corrective.joint != joint) {
          joint = corrective.joint;
          rotation = rotation_matrix(r);
        }
        const int row = corrective.component / 3;
        const int column = corrective.component % 3;
        features[c] = rotation(row, column) - (row == column ? 1 : 0);
        break;
      }
      case PoseFeature::QuaternionEntry:
        features[c] = quaternion_of(r)[corrective.component] - (corrective.component == 3 ? 1 : 0);
        break;
      case PoseFeature::Bend: {
        const double lean = bend_lean(corrective, r);
        features[c] = 2 * lean * lean;
        break;
      }
    }
  }
  return features;
}

Points pose_features_gradient(const BodyModel& model, const Pose& pose) {
  check_pose(model, pose);
  Points gradient(static_cast<Index>(model.correctives.size()), 3);
  int joint = -1;
  std::array<Eigen::Matrix3d, 3> derivative;
  for (Index c = 0; c < gradient.rows(); ++c) {
    const PoseCorrective& corrective = model.correctives[static_cast<std::size_t>(c)];
    const Eigen::Vector3d r = pose.rotations.row(corrective.joint);
    switch (corrective.feature) {
      case PoseFeature::RotationEntry:
        if (corrective.joint != joint) {
          joint = corrective.joint;
          derivative = rotation_matrix_jacobian(r);
        }
        for (int i = 0; i < 3; ++i) {
          gradient(c, i) = derivative[static_cast<std::size_t>(i)](corrective.component / 3,
                                                                   corrective.component % 3);
        }
        break;
      case PoseFeature::QuaternionEntry:
        gradient.row(c) = quaternion_jacobian(r).row(corrective.component);
        break;
      case PoseFeature::Bend:
        gradient.row(c) = 4 * bend_lean(corrective, r) * corrective.axis.transpose() *
                          quaternion_jacobian(r).topRows<3>();
        break;
    }
  }
  return gradient;
}

Points corrected_rest(const BodyModel& model, const ShapedBody& body, const Pose& pose) {
  Points rest = body.vertices;
  const Eigen::VectorXd features = pose_features(model, pose);
  for (Index c = 0; c < features.size(); ++c) {
    if (features[c] != 0) {
      add_scaled(model.correctives[static_cast<std::size_t>(c)].surface, features[c], rest);
    }
  }
  return rest;
}

std::vector<SkinTransform> skin_transforms(const ShapedBody& body, const JointFrames& frames) {
  ATELIER_CHECK(frames.rotations.size() == body.rest_rotations.size(),
                "frames of another skeleton");
  std::vector<SkinTransform> transforms(frames.rotations.size());
  for (std::size_t j = 0; j < transforms.size(); ++j) {
    const Index row = static_cast<Index>(j);
    const Eigen::Matrix3d rotation = frames.rotations[j] * body.rest_rotations[j].transpose();
    const Eigen::Vector3d rest = body.joints.row(row);
    const Eigen::Vector3d translation = frames.positions.row(row).transpose() - rotation * rest;
    Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> m(transforms[j].m);
    m << rotation, translation;
  }
  return transforms;
}

std::vector<DualQuaternion> dual_quaternions(const std::vector<SkinTransform>& transforms) {
  std::vector<DualQuaternion> duals(transforms.size());
  for (std::size_t j = 0; j < transforms.size(); ++j) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> m(transforms[j].m);
    const Eigen::Vector4d q = quaternion_of_matrix(m.leftCols<3>());
    const Eigen::Vector3d v = q.head<3>();
    const Eigen::Vector3d t = m.col(3);
    // dual = (t, 0) q / 2
    const Eigen::Vector3d dual = 0.5 * (q.w() * t + cross_matrix(t) * v);
    Eigen::Map<Eigen::Vector4d>(duals[j].real) = q;
    Eigen::Map<Eigen::Vector4d>(duals[j].dual) << dual, -0.5 * t.dot(v);
  }
  return duals;
}

Points skin_vertices(const BodyModel& model, const ShapedBody& body, const Pose& pose,
                     const SkinOptions& options) {
  check_pose(model, pose);
  ATELIER_CHECK(body.vertices.rows() == vertex_count(model), "shaped body of another model");
  const std::vector<SkinTransform> transforms =
      skin_transforms(body, forward_kinematics(body.skeleton, pose));
  const bool correct = options.correctives && !model.correctives.empty();
  const Points corrected = correct ? corrected_rest(model, body, pose) : Points();
  const Points& rest = correct ? corrected : body.vertices;
  const bool linear = options.method == SkinMethod::Linear;
  if (options.device == Device::Cpu) {
    return linear ? skin_linear_cpu(rest, model.skin, transforms, options.vectors)
                  : skin_dual_quaternion_cpu(rest, model.skin, dual_quaternions(transforms));
  }
#ifdef ATELIER_HAS_CUDA
  if (cuda_available()) {
    return linear ? skin_linear_cuda(rest, model.skin, transforms)
                  : skin_dual_quaternion_cuda(rest, model.skin, dual_quaternions(transforms));
  }
  throw EnvironmentError("cuda", "no CUDA device answers");
#else
  throw EnvironmentError("cuda", "this build has no CUDA");
#endif
}

Points skin_vertices(const BodyModel& model, const Pose& pose, const Eigen::VectorXd& shape,
                     const SkinOptions& options) {
  return skin_vertices(model, shape_body(model, shape), pose, options);
}

}  // namespace atelier
