#include "bodymodel/formats/motion_amass.h"

#include <algorithm>
#include <array>
#include <cctype>
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
#include "core/median.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr Index kSmplJoints = 24;
constexpr Index kSmplhJoints = 52;
constexpr Index kSmplxJoints = 55;
constexpr std::size_t kBodyNames = 22;  // that the whole family shares
constexpr double kFlat = 1e-9;          // radians
constexpr double kLevel = 0.35;         // sine of an arm of a T-pose: an A-pose has more
constexpr double kSameBeta = 1e-6;

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
  RowMatrix hand = RowMatrix::Zero(frames, 90);
  RowMatrix face = RowMatrix::Zero(frames, 9);
  if (npz.contains("pose_hand")) {
    hand = read(npz, "pose_hand", 90, frames, limits);
  }
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

// Letters and digits of an array of one text, in lower case: "smplx", "female". Empty where there
// is none, and of Python objects, as which some programs save their texts and which are never read.
std::string word_of(const Npz& npz, const char* name) {
  std::string word;
  if (!npz.contains(name)) {
    return word;
  }
  try {
    const Tensor tensor = npz.read(name);
    for (const char c : tensor.strings.size() == 1 ? tensor.strings[0] : std::string()) {
      if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
        word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      }
    }
  } catch (const DataError&) {
    word.clear();
  }
  return word;
}

// The person that a file is of: shapes, and of which body they are.
struct AmassPerson {
  std::vector<double> betas;
  std::string family;  // "SMPL", "SMPL-H", "SMPL-X"; "SMPL" and "SMPL-H" have the same shapes
  std::string gender;  // "female", "male", "neutral"; "" where it is not said
};

// The family by what the file says and by its number of joints. SMPL-X without its face has the 52
// joints of SMPL-H, and AMASS says SMPL where it means SMPL-H.
std::string family_of_file(const Npz& npz, Index joints) {
  const std::string said = word_of(npz, "surface_model_type");
  const bool is_x = said.starts_with("smplx");
  const bool is_h = said.starts_with("smplh");
  const bool fits = is_x             ? joints == kSmplxJoints || joints == kSmplhJoints
                    : is_h           ? joints == kSmplhJoints
                    : said == "smpl" ? joints == kSmplJoints || joints == kSmplhJoints
                                     : true;
  if (!fits) {
    throw DataError(npz.file(), "array 'poses'", std::to_string(3 * joints) + " columns",
                    std::string(is_x   ? "165, or 156 without the face"
                                : is_h ? "156"
                                       : "72 or 156") +
                        ", as its surface_model_type is " + said.substr(0, 20));
  }
  return is_x || joints == kSmplxJoints ? "SMPL-X" : joints == kSmplJoints ? "SMPL" : "SMPL-H";
}

// Betas [N] or of every frame [F,N], which are those of one person.
std::vector<double> read_betas(const Npz& npz, const Limits& limits,
                               std::vector<Finding>& findings) {
  if (!npz.contains("betas")) {
    return {};
  }
  const Tensor tensor = npz.read("betas");
  check_bounded(tensor, limits.mesh_coordinate, npz.file(), "betas");
  if (tensor.shape.size() < 2) {
    return doubles_of(tensor, npz.file(), "betas");
  }
  const RowMatrix rows = matrix_of(tensor, -1, npz.file(), "betas");
  if (rows.size() == 0) {
    return {};
  }
  const Eigen::RowVectorXd mean = rows.colwise().mean();
  const double off = (rows.rowwise() - mean).cwiseAbs().maxCoeff();
  if (off > kSameBeta) {
    findings.push_back({Severity::Note, "motion-shape", npz.file(),
                        "its betas change from frame to frame, by up to " + short_number(off),
                        "their mean is taken: a person has one shape"});
  }
  return {mean.data(), mean.data() + mean.size()};
}

AmassPerson person_of_file(const Npz& npz, Index joints, const Limits& limits,
                           std::vector<Finding>& findings) {
  AmassPerson person;
  person.family = family_of_file(npz, joints);
  person.betas = read_betas(npz, limits, findings);
  person.gender = word_of(npz, "gender");
  if (person.gender != "female" && person.gender != "male" && person.gender != "neutral") {
    person.gender = "";
  }
  return person;
}

// Family and gender of a body, as read_smpl names it: "smplx_female".
std::string family_of_body(const BodyModel& model) {
  const auto joints = static_cast<Index>(model.skeleton.names.size());
  return model.name.starts_with("star") ? "STAR"
         : joints == kSmplxJoints       ? "SMPL-X"
         : joints == kSmplJoints        ? "SMPL"
                                        : "SMPL-H";
}

std::string gender_of_body(const BodyModel& model) {
  const std::size_t at = model.name.rfind('_');
  const std::string last = at == std::string::npos ? "" : model.name.substr(at + 1);
  return last == "female" || last == "male" || last == "neutral" ? last : "";
}

// Whose shapes the file's betas are where they are not the body's, which have another meaning; ""
// where they are, or where all are 0.
std::string whose_betas(const AmassPerson& person, const BodyModel& model) {
  if (std::all_of(person.betas.begin(), person.betas.end(),
                  [](double beta) { return std::abs(beta) <= kSameBeta; })) {
    return "";
  }
  const auto shapes = [](const std::string& family) {
    return family == "SMPL-H" ? std::string("SMPL") : family;
  };
  const std::string body = family_of_body(model);
  if (shapes(person.family) != shapes(body)) {
    return "its betas are shapes of " + person.family + ", and the body is " + body;
  }
  const std::string gender = gender_of_body(model);
  return !person.gender.empty() && !gender.empty() && person.gender != gender
             ? "its betas are shapes of the " + person.gender + " body of " + person.family +
                   ", and the body is the " + gender + " one"
             : "";
}

// The body's shape by betas that are its own.
Eigen::VectorXd shape_of_betas(const AmassPerson& person, const BodyModel& model,
                               const std::string& file, std::vector<Finding>& findings) {
  Eigen::VectorXd shape = neutral_shape(model);
  int beyond = 0;
  int taken = 0;
  for (std::size_t b = 0; b < person.betas.size(); ++b) {
    const int parameter = find_shape(model, "beta_" + std::to_string(b));
    if (parameter >= 0) {
      shape[parameter] = person.betas[b];
      ++taken;
    }
    beyond += parameter < 0 && std::abs(person.betas[b]) > kSameBeta ? 1 : 0;
  }
  if (beyond > 0) {
    findings.push_back({Severity::Note, "motion-betas", file,
                        std::to_string(beyond) + " of its " + std::to_string(person.betas.size()) +
                            " betas are beyond the " + std::to_string(taken) +
                            " that the body is read with",
                        "they are left out; rotations and path do not depend on them"});
  }
  return shape;
}

// The skeleton of the user's body at the shape that is asked for; a file of another person is said.
Skeleton skeleton_of_body(const AmassPerson& person, const BodyModel& model,
                          const Eigen::VectorXd& shape, const std::string& file,
                          std::vector<Finding>& findings) {
  if (const std::string whose = whose_betas(person, model); !whose.empty()) {
    findings.push_back({Severity::Warning, "motion-shape", file, whose,
                        "they are left out: take the body that the file was made with, or say the "
                        "person's shape on this one by --shape"});
    return shaped_skeleton(model, shape.size() == 0 ? neutral_shape(model) : shape);
  }
  const Eigen::VectorXd own = shape_of_betas(person, model, file, findings);
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
    const bool unsure = !person.gender.empty() && gender_of_body(model).empty();
    findings.push_back(
        {Severity::Note, "motion-shape", file,
         "the motion is of a person of another shape than the body",
         "its rotations and path are taken as they are; --shape " + values + " makes that person" +
             (unsure ? " on the " + person.gender + " body of " + person.family : "")});
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

// The world's rotation from the file's up axis to Y, and its path in metres about the pelvis, which
// the rotation of the root turns about.
void place_root(MotionClip& clip, const RowMatrix& path, const Eigen::Matrix3d& turn,
                double metres_per_unit) {
  const Eigen::Vector3d pelvis = clip.skeleton.offsets.row(0);
  for (std::size_t frame = 0; frame < clip.motion.poses.size(); ++frame) {
    clip.motion.poses[frame].root_translation =
        turn * (pelvis + metres_per_unit * path.row(static_cast<Index>(frame)).transpose()) -
        pelvis;
  }
}

constexpr std::array kFeet = {"left_ankle", "right_ankle", "left_foot", "right_foot"};
constexpr std::array kStiff = {"spine1",      "spine2",      "spine3",       "neck",
                               "head",        "left_collar", "right_collar", "left_ankle",
                               "right_ankle", "left_foot",   "right_foot"};

template <std::size_t N>
std::vector<int> joints_named(const MotionClip& clip, const std::array<const char*, N>& names) {
  std::vector<int> joints;
  for (const char* name : names) {
    joints.push_back(find_joint(clip.skeleton, name));
  }
  return joints;
}

Points posed_joints(const MotionClip& clip, std::size_t frame) {
  return forward_kinematics(clip.skeleton, clip.motion.poses[frame]).positions;
}

// How a person goes in the unit of the path: metres, if it is in metres.
struct Going {
  double feet = 0;   // by how much the feet move against the pelvis, over what it moves; < 0: stays
  double speed = 0;  // of the pelvis, 1/s
  double height = 0;  // of the pelvis above 0, median
  double leg = 0;     // m, of the pelvis above the lowest joint, median
};

Going going_of(const MotionClip& clip) {
  constexpr double kStepTime = 0.1;     // s; shorter than a foot stands
  constexpr std::size_t kSteps = 2000;  // that are looked at
  const std::size_t frames = clip.motion.poses.size();
  const std::size_t step = std::clamp<std::size_t>(
      saturating_cast<std::size_t>(std::round(kStepTime * clip.motion.fps)), 1, frames);
  const std::vector<int> feet = joints_named(clip, kFeet);
  std::vector<double> heights;
  std::vector<double> legs;
  double moved = 0;
  double against = 0;
  double seconds = 0;
  const std::size_t stride = 1 + frames / kSteps;
  for (std::size_t frame = 0; frame < frames; frame += stride) {
    const Points now = posed_joints(clip, frame);
    heights.push_back(now(0, 1));
    legs.push_back(now(0, 1) - now.col(1).minCoeff());
    if (frame + step >= frames) {
      continue;
    }
    const Points then = posed_joints(clip, frame + step);
    const Eigen::RowVector3d path = then.row(0) - now.row(0);
    for (const int foot : feet) {
      against += (then.row(foot) - now.row(foot) - path).norm() / static_cast<double>(feet.size());
    }
    moved += path.norm();
    seconds += static_cast<double>(step) / clip.motion.fps;
  }
  return {moved > 0 ? against / moved : -1, seconds > 0 ? moved / seconds : 0, median(heights),
          median(legs)};
}

// Whether the feet then stand at a height of 0, of a pelvis that is nowhere near in metres.
bool stands_in(double unit, const Going& going) {
  constexpr double kFar = 20;  // m
  const double height = unit * going.height;
  return going.height > kFar && height > 0.7 * going.leg && height < 1.6 * going.leg;
}

// Metres in a unit of the path: 0.01 or 0.001 where it goes a hundred or a thousand times as far as
// the feet say, faster than anybody runs or at a height that fits, or stands where the pelvis would
// be tens of metres above the floor; else 1. A finding of either, and where feet alone say it.
double unit_of_path(MotionClip& clip) {
  // Feet move against the pelvis by about what it moves, whatever a person does on them: in real
  // motions 0.3 to 3 times that. A hundredth of it is a path in centimetres, or somebody who rolls.
  constexpr double kStill = 1e-5;
  constexpr double kOfMetres = 0.1;
  constexpr double kOfCentimetres = 0.003;
  constexpr double kRolls = 0.03;  // skaters move their feet by more
  constexpr double kInPlace = 10;
  constexpr double kFastest = 15;  // m/s
  const Going going = going_of(clip);
  const bool steps = going.feet > kStill && going.feet < kInPlace;
  const bool in_metres = steps && going.feet > kOfMetres;
  const double by_height = stands_in(0.01, going) ? 0.01 : stands_in(0.001, going) ? 0.001 : 1;
  const double by_feet = !steps || in_metres ? 1 : going.feet > kOfCentimetres ? 0.01 : 0.001;
  const double unit = by_height < 1 ? by_height : by_feet;
  const bool sure = !in_metres && (by_height < 1 || going.speed > kFastest);
  if (unit == 1 || (!sure && !in_metres && going.feet > kRolls)) {
    return 1;
  }
  const std::string why = by_feet < 1
                              ? ": in metres the pelvis moves " + short_number(1 / going.feet, 2) +
                                    " times as far as the feet move against it"
                              : ": in metres the person floats far above the floor";
  clip.findings.push_back(
      {Severity::Warning, "motion-unit", clip.name,
       std::string(sure ? "its trans is in " : "its trans may be in ") +
           (unit == 0.01 ? "centimetres" : "millimetres") + why,
       sure ? "it is multiplied by " + short_number(unit) +
                  "; --motion.metres-per-unit 1 if it is in metres"
            : "say --motion.metres-per-unit " + short_number(unit) + ", or 1 if it is in metres"});
  return sure ? unit : 1;
}

// Rotation vectors that no trunk, neck or foot turns by, of more than 115 degrees in most frames,
// or of several turns: degrees.
void doubt_radians(MotionClip& clip) {
  constexpr double kMostTurn = 2;  // rad
  constexpr double kTurns = 4 * std::numbers::pi;
  const std::vector<int> stiff = joints_named(clip, kStiff);
  double largest = 0;
  std::vector<double> of_frame;
  for (const Pose& pose : clip.motion.poses) {
    double turned = 0;
    for (const int joint : stiff) {
      turned = std::max(turned, pose.rotations.row(joint).norm());
    }
    of_frame.push_back(turned);
    const Index others = pose.rotations.rows() - 1;  // the root may turn as often as it likes
    largest = std::max(largest, pose.rotations.bottomRows(others).cwiseAbs().maxCoeff());
  }
  const double usual = median(of_frame);
  if (largest > kTurns || usual > kMostTurn) {
    clip.findings.push_back({Severity::Warning, "motion-degrees", clip.name,
                             "rotation vectors of up to " + short_number(largest) +
                                 (largest > kTurns ? std::string()
                                                   : ", and of " + short_number(usual) +
                                                         " in trunk, neck or feet of most frames") +
                                 ": they look like degrees, and AMASS has radians",
                             "multiply poses by 0.01745329"});
  }
}

// Files of others have the arrays of AMASS and Y up. In such a file, read as Z up, people lie.
void doubt_up_axis(MotionClip& clip) {
  constexpr double kLying = 0.7;  // mean cosine of the trunk with the axis that would be up
  const int neck = find_joint(clip.skeleton, "neck");
  Eigen::Vector3d trunk = Eigen::Vector3d::Zero();
  for (std::size_t frame = 0; frame < clip.motion.poses.size(); ++frame) {
    const Points joints = posed_joints(clip, frame);
    trunk += (joints.row(neck) - joints.row(0)).normalized().transpose();
  }
  trunk /= static_cast<double>(clip.motion.poses.size());
  if (trunk.z() < -kLying) {
    clip.findings.push_back(
        {Severity::Warning, "motion-up", clip.name,
         "the person lies throughout, and would stand if Y were up in this file",
         "--motion.up y if that is so; AMASS has Z up"});
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

MotionClip read_amass(const Npz& npz, const BodyModel* model, const Eigen::VectorXd& shape,
                      const MotionOptions& options, const Limits& limits) {
  const char up = options.up;
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
  const AmassPerson person = person_of_file(npz, joints, limits, clip.findings);
  if (model != nullptr && is_smpl_skeleton(model->skeleton)) {
    clip.skeleton = skeleton_of_body(person, *model, shape, npz.file(), clip.findings);
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
  for (Index frame = 0; frame < frames; ++frame) {
    Pose pose = rest_pose(clip.skeleton);
    for (std::size_t j = 0; j < from.size(); ++j) {
      if (from[j] >= 0) {
        pose.rotations.row(static_cast<Index>(j)) = poses.block<1, 3>(frame, 3 * from[j]);
      }
    }
    pose.rotations.row(0) = rotation_vector(turn * rotation_matrix(pose.rotations.row(0)));
    clip.motion.poses.push_back(std::move(pose));
    clip.motion.frame_ids.push_back(static_cast<int>(frame));
  }
  place_root(clip, path, turn, options.metres_per_unit > 0 ? options.metres_per_unit : 1);
  check_motion_clip(clip, npz.file());
  if (options.metres_per_unit == 0) {
    place_root(clip, path, turn, unit_of_path(clip));
  }
  doubt_radians(clip);
  if (up == 0) {
    doubt_up_axis(clip);
  }
  return clip;
}

MotionClip read_amass(const std::filesystem::path& path, const BodyModel* model,
                      const Eigen::VectorXd& shape, const MotionOptions& options,
                      const Limits& limits) {
  MotionClip clip = read_amass(Npz(path, limits), model, shape, options, limits);
  clip.name = path.stem().string();
  return clip;
}

}  // namespace atelier
