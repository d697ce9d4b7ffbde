#pragma once

#include <cmath>

#include "bodymodel/body_model.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/motion_clip.h"

namespace atelier::fixtures {

/// Names of the joints of `person_skeleton`, in its order, as one rig would have it.
using PersonNames = std::vector<std::string>;

inline PersonNames mixamo_names() {
  return {"Hips",     "LeftUpLeg",    "LeftLeg",      "LeftFoot",    "LeftToeBase", "RightUpLeg",
          "RightLeg", "RightFoot",    "RightToeBase", "Spine",       "Spine1",      "Neck",
          "Head",     "LeftShoulder", "LeftArm",      "LeftForeArm", "LeftHand",    "RightShoulder",
          "RightArm", "RightForeArm", "RightHand"};
}

/// A T-posed adult of 21 joints, ankles 9 cm above the floor at y = 0, facing +Z.
inline Skeleton person_skeleton(const PersonNames& names = mixamo_names()) {
  Skeleton skeleton;
  skeleton.names = names;
  skeleton.parents = {-1, 0, 1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 10, 13, 14, 15, 10, 17, 18, 19};
  skeleton.offsets.resize(21, 3);
  skeleton.offsets << 0, 0.97, 0,                                        //
      0.09, -0.05, 0, 0, -0.42, 0.01, 0, -0.41, -0.01, 0, -0.07, 0.13,   //
      -0.09, -0.05, 0, 0, -0.42, 0.01, 0, -0.41, -0.01, 0, -0.07, 0.13,  //
      0, 0.12, 0, 0, 0.2, 0, 0, 0.2, 0, 0, 0.1, 0.02,                    //
      0.05, 0.15, 0, 0.13, 0, 0, 0.28, 0, 0, 0.25, 0, 0,                 //
      -0.05, 0.15, 0, -0.13, 0, 0, -0.28, 0, 0, -0.25, 0, 0;
  return skeleton;
}

/// Five frames in which the person walks a little and raises an arm; the left foot stands.
inline MotionClip person_clip(const PersonNames& names = mixamo_names()) {
  MotionClip clip;
  clip.name = "person";
  clip.skeleton = person_skeleton(names);
  clip.motion.fps = 30;
  for (int i = 0; i < 5; ++i) {
    Pose pose = rest_pose(clip.skeleton);
    pose.root_translation = {0, 0, 0.02 * i};
    pose.rotations.row(14) << 0, 0.1 * i, -0.2 * i;
    pose.rotations.row(6) << 0.1 * i, 0, 0;
    clip.motion.poses.push_back(pose);
    clip.motion.frame_ids.push_back(i);
  }
  return clip;
}

/// A body of the skeleton: one small tetrahedron of skin round each joint.
inline BodyModel person_body(const Skeleton& skeleton) {
  BodyModel model;
  model.name = "person";
  model.skeleton = skeleton;
  const Points joints = rest_positions(skeleton);
  const Index count = joints.rows();
  model.mesh.vertices.resize(4 * count, 3);
  model.mesh.faces.resize(4 * count, 3);
  model.skin.joints.resize(4 * count, 1);
  model.skin.weights = Eigen::MatrixXd::Ones(4 * count, 1);
  for (Index j = 0; j < count; ++j) {
    const double r = 0.02;
    model.mesh.vertices.middleRows(4 * j, 4) << r, 0, 0, 0, r, 0, 0, 0, r, -r, -r, -r;
    model.mesh.vertices.middleRows(4 * j, 4).rowwise() += joints.row(j);
    const int v = static_cast<int>(4 * j);
    model.mesh.faces.middleRows(4 * j, 4) << v, v + 1, v + 2, v, v + 2, v + 3, v, v + 3, v + 1,
        v + 1, v + 3, v + 2;
    model.skin.joints.middleRows(4 * j, 4).setConstant(static_cast<int>(j));
  }
  return model;
}

}  // namespace atelier::fixtures
