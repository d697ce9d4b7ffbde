#include "bodymodel/formats/motion_amass.h"

#include <algorithm>
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

namespace atelier {
namespace {

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
      if (values.size() != 1 || !(values[0] > 0 && values[0] < 1e5)) {
        throw DataError(npz.file(), std::string("array '") + name + "'",
                        values.empty() ? "nothing" : std::to_string(values[0]),
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

Skeleton shaped_by_file(const Npz& npz, const BodyModel& model, Index joints,
                        const Limits& limits) {
  if (joint_count(model) != joints) {
    throw DataError(npz.file(), "poses", std::to_string(joints) + " joints",
                    std::to_string(joint_count(model)) + " as body model " + model.name + " has");
  }
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
  return shaped_skeleton(model, shape);
}

}  // namespace

MotionClip read_amass(const Npz& npz, const BodyModel* model, const Limits& limits) {
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
  if (model != nullptr) {
    clip.skeleton = shaped_by_file(npz, *model, joints, limits);
  } else {
    clip.skeleton = average_skeleton(joints);
    clip.findings.push_back({Severity::Note, "motion-skeleton", npz.file(),
                             "the file has no skeleton, and no body model was given",
                             "an average adult's is used; give the SMPL model for exact joints"});
  }
  // The body is Y up, the world Z up: the world is turned, which turns the root about its joint.
  const Eigen::Matrix3d turn = axis_rotation(0, -std::numbers::pi / 2);
  const Eigen::Vector3d pelvis = clip.skeleton.offsets.row(0);
  for (Index frame = 0; frame < frames; ++frame) {
    Pose pose;
    pose.rotations = Eigen::Map<const Points>(poses.data() + frame * poses.cols(), joints, 3);
    pose.rotations.row(0) = rotation_vector(turn * rotation_matrix(pose.rotations.row(0)));
    pose.root_translation = turn * (pelvis + path.row(frame).transpose()) - pelvis;
    clip.motion.poses.push_back(std::move(pose));
    clip.motion.frame_ids.push_back(static_cast<int>(frame));
  }
  check_motion_clip(clip, npz.file());
  return clip;
}

MotionClip read_amass(const std::filesystem::path& path, const BodyModel* model,
                      const Limits& limits) {
  MotionClip clip = read_amass(Npz(path, limits), model, limits);
  clip.name = path.stem().string();
  return clip;
}

}  // namespace atelier
