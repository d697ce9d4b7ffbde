#pragma once

#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning_math.h"
#include "core/device.h"
#include "core/pose.h"

namespace atelier {

/// How joints move skin.
enum class SkinMethod {
  Linear,          ///< linear blend skinning: what every model here is made for; has derivatives
  DualQuaternion,  ///< keeps volume under twists, bulges under bends (Kavan et al. 2008)
};

struct SkinOptions {
  SkinMethod method = SkinMethod::Linear;
  bool correctives = true;      ///< add the model's pose correctives; off is faster and coarser
  Device device = Device::Cpu;  ///< where vertices are skinned; joints are always on the CPU
  bool vectors = true;  ///< AVX2 for linear skinning where the processor has it; off for the
                        ///< bits that every processor gives
};

/// A body at one shape, in its rest pose: computed once, posed many times.
struct ShapedBody {
  Skeleton skeleton;  ///< offsets at this shape
  Points vertices;    ///< [V,3] rest vertices without pose correctives, metres
  Points joints;      ///< [J,3] rest joint positions, metres
  std::vector<Eigen::Matrix3d> rest_rotations;  ///< [J] world_from_joint at rest
};

/// Evaluates the shape space. `shape` has one value per parameter, or none for the neutral shape;
/// throws LogicError otherwise. O(V S).
ShapedBody shape_body(const BodyModel& model, const Eigen::VectorXd& shape = {});

/// The model with `shape` as its neutral shape: what formats without a shape space get, and what
/// keeps a shape for good. Every shape of it is that of the model. Throws LogicError for a shape of
/// another length; ranges widen to hold the new neutral values. O(V S).
BodyModel at_shape(const BodyModel& model, const Eigen::VectorXd& shape);

/// The features of all correctives at a pose, [C], and their derivatives by the rotation of the
/// joint that each one follows, [C,3]. Throws LogicError if the pose has another number of joints.
Eigen::VectorXd pose_features(const BodyModel& model, const Pose& pose);
Points pose_features_gradient(const BodyModel& model, const Pose& pose);

/// Rest vertices of the shape plus the pose's correctives, [V,3].
Points corrected_rest(const BodyModel& model, const ShapedBody& body, const Pose& pose);

/// The transform of rest points by each joint at the frames of a pose, [J].
std::vector<SkinTransform> skin_transforms(const ShapedBody& body, const JointFrames& frames);

/// The same as dual quaternions, [J].
std::vector<DualQuaternion> dual_quaternions(const std::vector<SkinTransform>& transforms);

/// Posed vertices [V,3], metres. Throws LogicError on sizes that do not agree, EnvironmentError if
/// the device is not there. O(V K) without correctives. Same bits on any number of threads;
/// with `vectors`, on any processor that has AVX2.
Points skin_vertices(const BodyModel& model, const ShapedBody& body, const Pose& pose,
                     const SkinOptions& options = {});

/// One-shot form: shapes, then poses.
Points skin_vertices(const BodyModel& model, const Pose& pose, const Eigen::VectorXd& shape = {},
                     const SkinOptions& options = {});

}  // namespace atelier
