#include "bodymodel/formats/motion_amass.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

#include "bodymodel/euler.h"
#include "bodymodel/formats/smpl.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/rotation.h"
#include "bodymodel/skinning.h"
#include "core/check_bounded.h"
#include "core/error.h"
#include "core/io/npz.h"
#include "core/printable.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr Index kSmplJoints = 24;
constexpr std::size_t kBodyNames = 22;  // that the whole family shares
constexpr double kFlat = 1e-9;          // radians
constexpr double kLevel = 0.35;         // sine of an arm of a T-pose: an A-pose has more
constexpr double kSameBeta = 1e-6;
constexpr double kLyingTrunk = 0.7;  // mean cosine of the trunk with the axis that would be up

RowMatrix read(const Npz& npz, const char* name, Index columns, Index rows, const Limits& limits) {
  const std::string where = std::string("array '") + name + "'";
  if (!npz.contains(name)) {
    throw DataError(npz.file(), where, "missing",
                    "poses, trans and a frame rate (AMASS: SMPL-H or SMPL-X)");
  }
  const Tensor tensor = npz.read(name);
  check_bounded(tensor, limits.mesh_coordinate, npz.file(), name);
  const RowMatrix matrix = matrix_of(tensor, columns, npz.file(), name);
  if (rows >= 0 && matrix.rows() != rows) {
    throw DataError(npz.file(), where, std::to_string(matrix.rows()) + " frames",
                    std::to_string(rows) + ", as 'trans' has");
  }
  return matrix;
}

double read_rate(const Npz& npz) {
  for (const char* name : {"mocap_framerate", "mocap_frame_rate", "mocap_fps", "fps"}) {
    if (npz.contains(name)) {
      const std::vector<double> values = doubles_of(npz.read(name), npz.file(), name);
      if (values.size() != 1 || !(values[0] > 0 && std::isfinite(values[0]))) {
        throw DataError(
            npz.file(), std::string("array '") + name + "'",
            values.size() == 1 ? short_number(values[0]) : counted(std::ssize(values), "number"),
            "one frame rate, more than 0");
      }
      return values[0];
    }
  }
  throw DataError(npz.file(), "array 'mocap_framerate'", "missing",
                  "the frame rate (mocap_framerate or mocap_frame_rate)");
}

// All rotation vectors, [F, 3J].
RowMatrix read_poses(const Npz& npz, Index frames, const Limits& limits) {
  if (npz.contains("poses")) {
    const RowMatrix poses = read(npz, "poses", -1, frames, limits);
    if (poses.cols() != 72 && poses.cols() != 156 && poses.cols() != 165) {
      throw DataError(npz.file(), "array 'poses'", std::to_string(poses.cols()) + " columns",
                      "72 (SMPL), 156 (SMPL-H) or 165 (SMPL-X)");
    }
    return poses;
  }
  const RowMatrix root = read(npz, "root_orient", 3, frames, limits);
  const RowMatrix body = read(npz, "pose_body", 63, frames, limits);
  const RowMatrix hand = read(npz, "pose_hand", 90, frames, limits);
  RowMatrix face = RowMatrix::Zero(frames, 9);
  if (npz.contains("pose_jaw")) {
    face.leftCols(3) = read(npz, "pose_jaw", 3, frames, limits);
  }
  if (npz.contains("pose_eye")) {
    face.rightCols(6) = read(npz, "pose_eye", 6, frames, limits);
  }
  RowMatrix poses(frames, 165);
  poses << root, body, face, hand;
  return poses;
}

// A T-posed adult of 1.70 m: segment lengths as shares of stature (Drillis and Contini 1966; hands
// after Buryanov and Kotiuk 2010), joints named and ordered as the SMPL family does.
Skeleton average_skeleton(Index joints) {
  Skeleton skeleton;
  skeleton.names = smpl_joint_names(joints);
  skeleton.parents = smpl_parents(joints);
  skeleton.offsets = Points::Zero(joints, 3);
  const std::map<std::string, Eigen::RowVector3d> left = {
      {"hip", {0.09, -0.09, 0}},     {"knee", {0.01, -0.41, 0}},     {"ankle", {0, -0.415, -0.02}},
      {"foot", {0.02, -0.06, 0.12}}, {"collar", {0.07, 0.12, 0}},    {"shoulder", {0.11, 0.03, 0}},
      {"elbow", {0.29, 0, 0}},       {"wrist", {0.25, 0, 0}},        {"hand", {0.09, 0, 0}},
      {"index1", {0.09, 0, 0.03}},   {"middle1", {0.095, 0, 0}},     {"pinky1", {0.08, 0, -0.04}},
      {"ring1", {0.09, 0, -0.02}},   {"thumb1", {0.03, -0.01, 0.03}}};
  const std::map<std::string, Eigen::RowVector3d> middle = {
      {"pelvis", {0, 0, 0}},       {"spine1", {0, 0.11, -0.01}}, {"spine2", {0, 0.13, 0}},
      {"spine3", {0, 0.05, 0.01}}, {"neck", {0, 0.21, -0.02}},   {"head", {0, 0.09, 0.03}},
      {"jaw", {0, -0.01, 0.02}}};
  for (Index j = 0; j < joints; ++j) {
    const std::string& name = skeleton.names[static_cast<std::size_t>(j)];
    Eigen::RowVector3d offset = Eigen::RowVector3d::Zero();
    if (middle.contains(name)) {
      offset = middle.at(name);
    } else {
      const bool is_left = name.starts_with("left_");
      const std::string part = name.substr(name.find('_') + 1);
      if (left.contains(part)) {
        offset = left.at(part);
      } else if (part.starts_with("eye")) {
        offset = {0.03, 0.06, 0.08};
      } else {
        offset = {0.03, 0, 0};  // second and third knuckles
      }
      offset.x() *= is_left ? 1 : -1;
    }
    skeleton.offsets.row(j) = offset;
  }
  return skeleton;
}

// A body's shape by the file's betas.
Eigen::VectorXd shape_of_file(const Npz& npz, const BodyModel& model, const Limits& limits) {
  Eigen::VectorXd shape = neutral_shape(model);
  if (npz.contains("betas")) {
    const Tensor tensor = npz.read("betas");
    check_bounded(tensor, limits.mesh_coordinate, npz.file(), "betas");
    const std::vector<double> betas = doubles_of(tensor, npz.file(), "betas");
    for (std::size_t b = 0; b < betas.size(); ++b) {
      const int parameter = find_shape(model, "beta_" + std::to_string(b));
      if (parameter >= 0) {
        shape[parameter] = betas[b];
      }
    }
  }
  return shape;
}

// The skeleton of the user's body at the shape that is asked for; a file of another person is said.
Skeleton skeleton_of_body(const Npz& npz, const BodyModel& model, const Eigen::VectorXd& shape,
                          const Limits& limits, std::vector<Finding>& findings) {
  const Eigen::VectorXd own = shape_of_file(npz, model, limits);
  if (shape.size() == 0) {
    return shaped_skeleton(model, own);
  }
  std::string values;
  for (std::size_t s = 0; s < model.shape.size(); ++s) {
    const auto row = static_cast<Index>(s);
    if (std::abs(own[row] - shape[row]) > kSameBeta) {
      char text[80];
      std::snprintf(text, sizeof text, "%s%s=%.4g", values.empty() ? "" : ",",
                    model.shape[s].name.substr(0, 40).c_str(), own[row]);
      values += text;
    }
  }
  if (!values.empty()) {
    findings.push_back(
        {Severity::Note, "motion-shape", npz.file(),
         "the motion is of a person of another shape than the body",
         "its rotations and path are taken as they are; --shape " + values + " makes that person"});
  }
  return shaped_skeleton(model, shape);
}

// Which joint of the file turns each joint of the skeleton, -1 for none.
std::vector<int> joints_by_name(const Skeleton& skeleton, Index joints, const RowMatrix& poses,
                                const std::string& file, std::vector<Finding>& findings) {
  const std::vector<std::string> names = smpl_joint_names(joints);
  std::vector<int> from(skeleton.names.size(), -1);
  Index lost = 0;
  for (Index j = 0; j < joints; ++j) {
    const int joint = find_joint(skeleton, names[static_cast<std::size_t>(j)]);
    if (joint >= 0) {
      from[static_cast<std::size_t>(joint)] = static_cast<int>(j);
    } else {
      lost += poses.middleCols(3 * j, 3).isZero(0) ? 0 : 1;
    }
  }
  if (lost > 0) {
    findings.push_back(
        {Severity::Note, "motion-joints", file,
         std::to_string(lost) + " joints that move are not on the body",
         "they are left out; a body of " + std::to_string(joints) + " joints has them"});
  }
  return from;
}

// Files of others have the arrays of AMASS and Y up. In such a file, read as Z up, people lie.
void doubt_up_axis(MotionClip& clip) {
  const int neck = find_joint(clip.skeleton, "neck");
  Eigen::Vector3d trunk = Eigen::Vector3d::Zero();
  for (const Pose& pose : clip.motion.poses) {
    const Points joints = forward_kinematics(clip.skeleton, pose).positions;
    trunk += (joints.row(neck) - joints.row(0)).normalized().transpose();
  }
  trunk /= static_cast<double>(clip.motion.poses.size());
  if (trunk.z() < -kLyingTrunk) {
    clip.findings.push_back(
        {Severity::Warning, "motion-up", clip.name,
         "the person lies throughout, and would stand if Y were up in this file",
         "--motion.up y if that is so; AMASS has Z up"});
  }
}

// Rotation vectors of several turns, which no joint makes: degrees.
void doubt_radians(const RowMatrix& poses, MotionClip& clip) {
  constexpr double kTurns = 4 * std::numbers::pi;
  const double largest = poses.cwiseAbs().maxCoeff();
  if (largest > kTurns) {
    clip.findings.push_back({Severity::Warning, "motion-degrees", clip.name,
                             "rotation vectors of up to " + short_number(largest) +
                                 ": they look like degrees, and AMASS has radians",
                             "multiply poses by 0.01745329"});
  }
}

}  // namespace

bool is_smpl_skeleton(const Skeleton& skeleton) {
  const std::vector<std::string> names = smpl_joint_names(kSmplJoints);
  const std::vector<int> parents = smpl_parents(kSmplJoints);
  if (skeleton.names.size() < kBodyNames ||
      (skeleton.rest_rotations.rows() > 0 && !skeleton.rest_rotations.isZero(kFlat))) {
    return false;
  }
  for (std::size_t j = 0; j < kBodyNames; ++j) {
    if (skeleton.names[j] != names[j] || skeleton.parents[j] != parents[j]) {
      return false;
    }
  }
  for (const char* side : {"left_", "right_"}) {
    const Eigen::RowVector3d arm =
        skeleton.offsets.row(find_joint(skeleton, side + std::string("elbow"))) +
        skeleton.offsets.row(find_joint(skeleton, side + std::string("wrist")));
    if (!(std::abs(arm.y()) < kLevel * arm.norm())) {
      return false;
    }
  }
  return true;
}

MotionClip read_amass(const Npz& npz, const BodyModel* model, const Eigen::VectorXd& shape, char up,
                      const Limits& limits) {
  ATELIER_CHECK(up == 0 || up == 'y' || up == 'z', "up is 'y' or 'z'");
  const RowMatrix path = read(npz, "trans", 3, -1, limits);
  const Index frames = path.rows();
  if (frames < 1 || frames > limits.frames) {
    throw DataError(npz.file(), "array 'trans'", std::to_string(frames) + " frames",
                    "1 to " + std::to_string(limits.frames));
  }
  const RowMatrix poses = read_poses(npz, frames, limits);
  const Index joints = poses.cols() / 3;

  MotionClip clip;
  clip.name = npz.file();
  clip.motion.fps = read_rate(npz);
  if (model != nullptr && is_smpl_skeleton(model->skeleton)) {
    clip.skeleton = skeleton_of_body(npz, *model, shape, limits, clip.findings);
  } else {
    clip.skeleton = average_skeleton(joints);
    clip.findings.push_back(
        {Severity::Note, "motion-skeleton", npz.file(),
         std::string("the file has no skeleton, and ") +
             (model == nullptr ? "no body model was given" : "the body is of another family"),
         "an average adult's is used; the SMPL body that it was made with has exact joints"});
  }
  const std::vector<int> from =
      joints_by_name(clip.skeleton, joints, poses, npz.file(), clip.findings);
  // The body is Y up, the world Z up: the world is turned, which turns the root about its joint.
  const Eigen::Matrix3d turn = axis_rotation(0, up == 'y' ? 0 : -std::numbers::pi / 2);
  const Eigen::Vector3d pelvis = clip.skeleton.offsets.row(0);
  for (Index frame = 0; frame < frames; ++frame) {
    Pose pose = rest_pose(clip.skeleton);
    for (std::size_t j = 0; j < from.size(); ++j) {
      if (from[j] >= 0) {
        pose.rotations.row(static_cast<Index>(j)) = poses.block<1, 3>(frame, 3 * from[j]);
      }
    }
    pose.rotations.row(0) = rotation_vector(turn * rotation_matrix(pose.rotations.row(0)));
    pose.root_translation = turn * (pelvis + path.row(frame).transpose()) - pelvis;
    clip.motion.poses.push_back(std::move(pose));
    clip.motion.frame_ids.push_back(static_cast<int>(frame));
  }
  doubt_radians(poses, clip);
  check_motion_clip(clip, npz.file());
  if (up == 0) {
    doubt_up_axis(clip);
  }
  return clip;
}

MotionClip read_amass(const std::filesystem::path& path, const BodyModel* model,
                      const Eigen::VectorXd& shape, char up, const Limits& limits) {
  MotionClip clip = read_amass(Npz(path, limits), model, shape, up, limits);
  clip.name = path.stem().string();
  return clip;
}

}  // namespace atelier
