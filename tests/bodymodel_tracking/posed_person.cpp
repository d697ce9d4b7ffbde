#include "tests/bodymodel_tracking/posed_person.h"

#include <cmath>

namespace atelier::fixtures {

const BodyModel& plain_human() {
  static const BodyModel model = [] {
    DefaultHumanOptions options;
    options.shape_basis = false;
    return default_human(options);
  }();
  return model;
}

const std::vector<std::string>& body_25_names() {
  static const std::vector<std::string> names = {
      "nose",           "neck",        "right_shoulder", "right_elbow",     "right_wrist",
      "left_shoulder",  "left_elbow",  "left_wrist",     "mid_hip",         "right_hip",
      "right_knee",     "right_ankle", "left_hip",       "left_knee",       "left_ankle",
      "right_eye",      "left_eye",    "right_ear",      "left_ear",        "left_big_toe",
      "left_small_toe", "left_heel",   "right_big_toe",  "right_small_toe", "right_heel"};
  return names;
}

const FittedPerson& fitted_human() {
  static const FittedPerson person = fitted_person(plain_human(), body_25_names());
  return person;
}

FrameTargets keypoints_of(const FittedPerson& person, const Eigen::VectorXd& x, double noise,
                          Random& random) {
  FrameTargets targets;
  targets.keypoints =
      marker_positions(person.places.riding,
                       forward_kinematics(person.shaped.skeleton, pose_of_variables(person, x)));
  for (Index k = 0; k < targets.keypoints.rows(); ++k) {
    for (int c = 0; c < 3; ++c) {
      targets.keypoints(k, c) += noise * normal(random);
    }
  }
  targets.deviations = Eigen::VectorXd::Constant(targets.keypoints.rows(), 0.005);
  return targets;
}

Eigen::VectorXd walking(const FittedPerson& person, double seconds) {
  Pose pose = rest_pose(person.shaped.skeleton);
  const auto turn = [&](const char* name, double x, double y, double z) {
    pose.rotations.row(find_joint(person.shaped.skeleton, name)) << x, y, z;
  };
  const double swing = std::sin(6 * seconds);
  turn("pelvis", 0, 1.2 * seconds, 0);
  turn("left_hip", -0.5 * swing, 0, 0);
  turn("right_hip", 0.5 * swing, 0, 0);
  turn("left_knee", 0.4 + 0.3 * swing, 0, 0);
  turn("right_knee", 0.4 - 0.3 * swing, 0, 0);
  turn("left_shoulder", 0.2 * swing, -0.3, -0.4);
  turn("right_shoulder", -0.2 * swing, 0.3, 0.4);
  turn("left_elbow", 0, -0.5 - 0.3 * swing, 0);
  turn("right_elbow", 0, 0.5 - 0.3 * swing, 0);
  turn("spine2", 0.05, 0.1 * swing, 0);
  pose.root_translation = {0.5 * seconds, 0.02 * swing, 0.3 * seconds};
  return pose_variables(person, pose);
}

Eigen::VectorXd turned(Eigen::VectorXd x, const std::string& name, double angle) {
  const int joint = find_joint(plain_human().skeleton, name);
  x[3 + 3 * static_cast<Index>(fitted_human().slots[static_cast<std::size_t>(joint)]) + 2] += angle;
  return x;
}

ScanPoints scan_of(const Eigen::VectorXd& x) {
  Mesh scan;
  scan.vertices = skin_vertices(plain_human(), pose_of_variables(fitted_human(), x));
  scan.faces = plain_human().mesh.faces;
  return scan_points(
      scan, std::vector<ScanPart>(static_cast<std::size_t>(scan.vertices.rows()), ScanPart::Skin));
}

double joint_error(const FittedPerson& person, const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd gap = sought_joints(person, a) - sought_joints(person, b);
  double sum = 0;
  for (Index j = 0; j < gap.size() / 3; ++j) {
    sum += gap.segment<3>(3 * j).norm();
  }
  return sum / static_cast<double>(gap.size() / 3);
}

}  // namespace atelier::fixtures
