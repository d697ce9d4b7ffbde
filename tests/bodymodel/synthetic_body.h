#pragma once

#include "bodymodel/body_model.h"
#include "bodymodel/kinematics.h"
#include "core/random.h"

namespace atelier::fixtures {

inline Points random_points(Random& random, Index rows, double scale) {
  Points points(rows, 3);
  for (Index i = 0; i < points.size(); ++i) {
    points.data()[i] = scale * normal(random);
  }
  return points;
}

/// A body of nothing in particular that uses every feature: a branching tree with rest rotations,
/// random vertices and weights, dense and sparse shape directions, every kind of pose corrective.
inline BodyModel synthetic_body(Index vertices = 40, int slots = 4, std::uint64_t seed = 1) {
  Random random{seed};
  BodyModel model;
  model.name = "synthetic";
  model.skeleton.names = {"root", "spine", "head", "left_arm", "left_hand", "right_arm", "leg"};
  model.skeleton.parents = {-1, 0, 1, 1, 3, 1, 0};
  const Index joints = static_cast<Index>(model.skeleton.names.size());
  model.skeleton.offsets = random_points(random, joints, 0.3);
  model.skeleton.rest_rotations = random_points(random, joints, 0.4);
  model.mesh.vertices = random_points(random, vertices, 0.5);
  model.mesh.faces.resize(vertices - 2, 3);
  for (int f = 0; f < vertices - 2; ++f) {
    model.mesh.faces.row(f) << f, f + 1, f + 2;
  }
  model.skin.joints.resize(vertices, slots);
  model.skin.weights.resize(vertices, slots);
  for (Index v = 0; v < vertices; ++v) {
    for (int k = 0; k < slots; ++k) {
      model.skin.joints(v, k) = static_cast<int>((v + 2 * k) % joints);
      model.skin.weights(v, k) = (v + k) % 5 == 0 ? 0 : uniform(random, 0.1, 1);
    }
    model.skin.weights.row(v) /= model.skin.weights.row(v).sum();
  }
  const Blendshape dense{{}, random_points(random, vertices, 0.1)};
  const Blendshape sparse{{1, 3, 4, 17}, random_points(random, 4, 0.1)};
  model.shape.push_back({"stature", "m", 1.7, 1.5, 2.0, dense, random_points(random, joints, 0.1)});
  model.shape.push_back({"belly", "", 0, -3, 3, sparse, Points::Zero(joints, 3)});
  for (int component = 0; component < 9; ++component) {
    model.correctives.push_back({3,
                                 PoseFeature::RotationEntry,
                                 component,
                                 Eigen::Vector3d::UnitX(),
                                 {{}, random_points(random, vertices, 0.05)}});
  }
  for (int component = 0; component < 4; ++component) {
    model.correctives.push_back({6,
                                 PoseFeature::QuaternionEntry,
                                 component,
                                 Eigen::Vector3d::UnitX(),
                                 {{0, 2, 5}, random_points(random, 3, 0.05)}});
  }
  model.correctives.push_back({4,
                               PoseFeature::Bend,
                               0,
                               Eigen::Vector3d(0.6, 0, 0.8),
                               {{7, 8, 9}, random_points(random, 3, 0.05)}});
  model.groups = {{"top", {0, 1, 2}}};
  return model;
}

inline Pose random_pose(const Skeleton& skeleton, std::uint64_t seed, double scale = 0.7) {
  Random random{seed, 77};
  Pose pose;
  pose.root_translation = random_points(random, 1, 1).row(0);
  pose.rotations = random_points(random, static_cast<Index>(skeleton.names.size()), scale);
  return pose;
}

}  // namespace atelier::fixtures
