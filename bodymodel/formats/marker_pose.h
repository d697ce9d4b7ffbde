#pragma once

#include <vector>

#include "bodymodel/kinematics.h"

namespace atelier {

/// Points that ride on joints.
struct RidingMarkers {
  std::vector<int> joints;  ///< [M]
  Points offsets;           ///< [M,3] metres, from the joint in its rest frame
};

/// Positions of the markers at the frames of a pose, [M,3] metres.
Points marker_positions(const RidingMarkers& markers, const JointFrames& frames);

/// Their derivatives by the pose vector (kinematics.h), [3M, 3+3J]. O(M depth).
Eigen::MatrixXd marker_positions_jacobian(const Skeleton& skeleton, const Pose& pose,
                                          const RidingMarkers& markers);

struct MarkerPoseOptions {
  double noise = 0.005;    ///< m, what a marker is trusted to, [1e-5, 0.1]; raise for keypoints
  double outlier = 0.1;    ///< m from which a marker counts less (Huber), [1e-3, 10]
  double rest_pull = 1.5;  ///< rad, spread of rotations about rest where markers leave them open
  double hold_pull = 1.0;  ///< rad, the same about the start; keeps bones from spinning
  bool limits = true;      ///< stay within the skeleton's joint limits (the root has none)
  int iterations = 60;     ///< at most, [1, 1000]
};

struct MarkerPose {
  Pose pose;
  double rms = 0;  ///< m, over the markers seen
  int iterations = 0;
  bool converged = false;  ///< the last step was below 1e-5 rad and m
};

/// The pose that brings the markers nearest to where they were seen: Levenberg-Marquardt on the
/// pose vector (Madsen, Nielsen, Tingleff, "Methods for non-linear least squares problems", 2004,
/// alg. 3.16), steps cut off at the joints' limits. The trunk's joints are pulled to rest more than
/// the limbs', so that the spine bends evenly. `seen` has M entries; unseen rows of `targets` are
/// ignored. Throws LogicError on sizes that do not agree. O(iterations (M J^2 + J^3)).
MarkerPose fit_pose(const Skeleton& skeleton, const RidingMarkers& markers, const Points& targets,
                    const std::vector<bool>& seen, const Pose& start,
                    const MarkerPoseOptions& options = {});

}  // namespace atelier
