#pragma once

#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "core/options.h"
#include "core/pose.h"
#include "core/random.h"

namespace atelier {

/// The subject of a synthetic capture, and how far it is from the assumptions of stages.
struct SubjectOptions {
  /// "random": the default human at random measures; "female", "male"; or a file that
  /// read_body_file knows.
  std::string body = "random";
  /// "real": with everything below; "exact": the body model itself, for debugging a stage, never
  /// for a reported figure.
  std::string subject = "real";
  double displacement = 0;     ///< m rms, off the shape space; 0: drawn from 5 to 10 mm
  double weight_jitter = 0.1;  ///< share by which skin weights differ
  double soft_tissue = 0.002;  ///< m, how far flesh lags behind the bones
};
OptionTable describe(SubjectOptions& options);

/// A point that rides on a joint.
struct JointPoint {
  int joint = 0;
  Eigen::Vector3d rest{0, 0, 0};  ///< metres, where it is in the rest pose
};

/// The body of a synthetic capture. Its model has no shape parameters left: it is one person.
struct SyntheticSubject {
  BodyModel model;  ///< template displaced, weights jittered
  std::vector<std::string> shape_names;
  Eigen::VectorXd shape;        ///< of the model that it was made from
  double displacement_rms = 0;  ///< m, over the area
  Eigen::VectorXd softness;     ///< [V] in [0, 1]: flesh that lags
  std::string description;      ///< one line
};

/// Draws one. Throws DataError for files that cannot be read or hold no person.
SyntheticSubject make_subject(const SubjectOptions& options, std::uint64_t seed);

/// Where detectors look for each point of COCO-WholeBody, with "neck" and "mid_hip" (those of
/// BODY_25) after them: names and places. Found on joints and, for the face, toes, heels and
/// fingertips, on the surface; the 68 of the face are a template cast on the head.
struct SubjectKeypoints {
  std::vector<std::string> names;
  std::vector<JointPoint> places;
};
SubjectKeypoints subject_keypoints(const BodyModel& model);

/// Places of joint points at a pose, [N,3].
Points posed_points(const BodyModel& model, const std::vector<JointPoint>& points,
                    const Pose& pose);

/// Flesh that lags behind skinned vertices: damped springs, one a vertex, whose swing saturates
/// (our choice): 4.5 Hz, damping ratio 0.25.
struct SoftTissue {
  Points offset, velocity;     ///< [V,3] m, m/s
  Points last, last_velocity;  ///< of the skinned vertices
  int steps = 0;
};
/// Where the flesh is after `seconds`, given where the bones' skin now is.
SoftTissue soft_tissue_step(SoftTissue state, const Points& skinned, double seconds);
/// Skinned vertices with the flesh's lag of at most about twice `amplitude` metres.
Points with_soft_tissue(const SyntheticSubject& subject, const Points& skinned,
                        const SoftTissue& state, double amplitude);

}  // namespace atelier
