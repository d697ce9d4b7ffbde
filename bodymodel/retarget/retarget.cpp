#include "bodymodel/retarget/retarget.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/motion_resample.h"
#include "bodymodel/retarget/retarget_align.h"
#include "bodymodel/retarget/retarget_contacts.h"
#include "bodymodel/rotation.h"
#include "bodymodel/skinning.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr double kMaxScale = 2.5;       // of steps, unsaid: from an adult to a small child
constexpr double kUprightCosine = 0.7;  // of trunk and legs: below it they lie apart
constexpr double kSameLength = 1e-6;    // of legs, and radians: rounding of a file
constexpr double kSole = 0.03;          // metres above the floor in which rest vertices are soles
constexpr Index kTouching = 1000;       // vertices sampled for the lowest point, half of them soles

double mean_turn(const Pose& a, const Pose& b) {
  double sum = 0;
  for (Index j = 0; j < a.rotations.rows(); ++j) {
    sum += rotation_vector(rotation_matrix(a.rotations.row(j)).transpose() *
                           rotation_matrix(b.rotations.row(j)))
               .norm();
  }
  return sum / static_cast<double>(std::max<Index>(1, a.rotations.rows()));
}

// A calibration pose jumps to the motion that follows it.
bool begins_with_t_pose(const Motion& motion) {
  if (motion.poses.size() < 4) {
    return false;
  }
  const double first = mean_turn(motion.poses[0], motion.poses[1]);
  const double usual = std::max(mean_turn(motion.poses[1], motion.poses[2]),
                                mean_turn(motion.poses[2], motion.poses[3]));
  constexpr double kJump = 0.03;  // radians a joint on average
  return first > kJump && first > 8 * usual;
}

// Rotation of the source's joints away from the reference, in the world.
Eigen::Matrix3d followed_turn(const Follow& follow, const JointFrames& now,
                              const JointFrames& reference) {
  const auto turn = [&](int joint) -> Eigen::Matrix3d {
    const std::size_t j = static_cast<std::size_t>(joint);
    return now.rotations[j] * reference.rotations[j].transpose();
  };
  Eigen::Matrix3d a = turn(follow.a);
  if (follow.share <= 0 || follow.b == follow.a) {
    return a;
  }
  return a * rotation_matrix(follow.share * rotation_vector(a.transpose() * turn(follow.b)));
}

// Throws DataError where legs have no length by which steps could be scaled.
double checked_legs(const Skeleton& skeleton, const Humanoid& person, const std::string& name) {
  const double legs = leg_length(skeleton, person);
  if (!(legs > 0) || !std::isfinite(legs)) {
    throw DataError(name, "skeleton", legs > 0 ? "legs without end" : "legs of 0 m",
                    "bones with a length, a person's");
  }
  return legs;
}

// A motion of a person half or twice as large is still one; beyond that a unit is wrong.
void add_scale_finding(double motion_legs, double body_legs, const std::string& name,
                       std::vector<Finding>& findings) {
  const double scale = body_legs / motion_legs;
  if (scale > kMaxScale || scale < 1 / kMaxScale) {
    char text[160];
    std::snprintf(
        text, sizeof text,
        "legs of %.3g m in the motion and of %.3g m on the body: steps are scaled by %.3g",
        motion_legs, body_legs, scale);
    findings.push_back({Severity::Warning, "retarget-scale", name, text,
                        "if a unit is wrong, set --motion.metres-per-unit or, of a body in a file, "
                        "--metres-per-unit"});
  }
}

// Cosine of the angle between trunk and legs: 1 standing, about 0 on all fours.
double trunk_along_legs(const Points& joints, const Humanoid& person) {
  const Eigen::RowVector3d trunk =
      joints.row(person.neck.back()) - joints.row(person.spine.front());
  const Eigen::RowVector3d legs = joints.row(person.legs[0].hip) + joints.row(person.legs[1].hip) -
                                  joints.row(person.legs[0].ankle) -
                                  joints.row(person.legs[1].ankle);
  return trunk.normalized().dot(legs.normalized());
}

// An animal has four legs and a head too. A person's rest pose may be anything, and so may be a
// motion; with trunk and legs at right angles in both, it is hardly a person.
void add_posture_finding(const MotionClip& clip, const Humanoid& person,
                         std::vector<Finding>& findings) {
  double mean = 0;
  for (const Pose& pose : clip.motion.poses) {
    mean += trunk_along_legs(forward_kinematics(clip.skeleton, pose).positions, person) /
            static_cast<double>(clip.motion.poses.size());
  }
  const double rest = trunk_along_legs(rest_positions(clip.skeleton), person);
  if (rest < kUprightCosine && mean < kUprightCosine) {
    findings.push_back({Severity::Warning, "retarget-posture", clip.name,
                        "trunk or legs lie level at rest and in the motion",
                        "nothing to do if it is a person; a four-legged animal's motion does not "
                        "fit one"});
  }
}

// Cosine between where the toes point and where somebody faces whose left joints are on the left:
// about 1, and about -1 of a mirror image whose names were kept. Nothing without toes.
std::optional<double> toes_ahead(const Points& joints, const Humanoid& person) {
  const Eigen::RowVector3d hips = joints.row(person.legs[0].hip) - joints.row(person.legs[1].hip);
  const Eigen::RowVector3d up =
      joints.row(person.neck.front()) -
      0.5 * (joints.row(person.legs[0].hip) + joints.row(person.legs[1].hip));
  const Eigen::RowVector3d front = hips.cross(up).normalized();
  Eigen::RowVector3d toes = Eigen::RowVector3d::Zero();
  for (const Leg& leg : person.legs) {
    if (leg.toe < 0) {
      return std::nullopt;
    }
    const Eigen::RowVector3d foot = joints.row(leg.toe) - joints.row(leg.ankle);
    toes += foot - foot.dot(up.normalized()) * up.normalized();
  }
  const double cosine = toes.normalized().dot(front);
  return std::isfinite(cosine) ? std::optional(cosine) : std::nullopt;
}

// Left-handed worlds, webcam pictures and flipped images give motions that are mirrored while
// their names are not: the performer's left arm moves the right one.
void add_mirror_finding(const MotionClip& clip, const Humanoid& person,
                        std::vector<Finding>& findings) {
  constexpr double kBackwards = -0.5;
  const std::optional<double> rest = toes_ahead(rest_positions(clip.skeleton), person);
  double sum = 0;
  int count = 0;
  for (const Pose& pose : clip.motion.poses) {
    const auto ahead = toes_ahead(forward_kinematics(clip.skeleton, pose).positions, person);
    sum += ahead.value_or(0);
    count += ahead ? 1 : 0;
  }
  if (rest && *rest < 0 && count > 0 && sum < kBackwards * count) {
    findings.push_back({Severity::Warning, "motion-mirrored", clip.name,
                        "the feet point backwards of somebody whose left joints are on the left: "
                        "the motion is a mirror image, or left and right are in each other's place",
                        "export it without mirroring, or exchange the names of left and right"});
  }
}

// The target's pose that follows the source's frames; the root stays where it is.
Pose followed_pose(const Skeleton& skeleton, const JointFrames& now,
                   const std::vector<Follow>& follows, const std::vector<const JointFrames*>& away,
                   const std::vector<Eigen::Matrix3d>& aligned) {
  Pose pose = rest_pose(skeleton);
  std::vector<Eigen::Matrix3d> world(skeleton.names.size());
  for (std::size_t j = 0; j < world.size(); ++j) {
    const int parent = skeleton.parents[j];
    Eigen::Matrix3d before =
        parent < 0 ? Eigen::Matrix3d::Identity().eval() : world[static_cast<std::size_t>(parent)];
    if (skeleton.rest_rotations.rows() > 0) {
      before = before * rotation_matrix(skeleton.rest_rotations.row(static_cast<Index>(j)));
    }
    if (follows[j].a < 0) {
      world[j] = before;
      continue;
    }
    world[j] = followed_turn(follows[j], now, *away[j]) * aligned[j];
    pose.rotations.row(static_cast<Index>(j)) = rotation_vector(before.transpose() * world[j]);
  }
  return pose;
}

Eigen::Vector3d hip_middle(const Points& joints, const Humanoid& person) {
  return 0.5 * (joints.row(person.legs[0].hip) + joints.row(person.legs[1].hip)).transpose();
}

// Which reference each target joint turns away from: feet and neck have their own.
std::vector<const JointFrames*> turned_away_from(const AlignmentReference& reference,
                                                 const Skeleton& skeleton, const Humanoid& to) {
  std::vector<const JointFrames*> away(skeleton.names.size(), &reference.frames);
  for (const int joint : to.neck) {
    away[static_cast<std::size_t>(joint)] = &reference.neck;
  }
  for (std::size_t side = 0; side < 2; ++side) {
    for (const int joint : {to.legs[side].ankle, to.legs[side].toe}) {
      if (joint >= 0) {
        away[static_cast<std::size_t>(joint)] = &reference.feet[side];
      }
    }
  }
  for (std::size_t j = 0; j < away.size(); ++j) {  // a jaw turns away from where its head does
    if (skeleton.parents[j] >= 0 && away[j] == &reference.frames) {
      away[j] = away[static_cast<std::size_t>(skeleton.parents[j])];
    }
  }
  return away;
}

// The target's poses that follow the clip; the hips go where the clip's go, scaled by the legs.
std::vector<Pose> followed_poses(const MotionClip& clip, const Humanoid& from,
                                 const Skeleton& skeleton, const Humanoid& to,
                                 const std::vector<Eigen::Matrix3d>& aligned,
                                 const std::vector<const JointFrames*>& away) {
  const std::vector<Follow> follows = correspondence(clip.skeleton, from, skeleton, to);
  const double scale = leg_length(skeleton, to) / leg_length(clip.skeleton, from);
  std::vector<Pose> poses;
  for (const Pose& source_pose : clip.motion.poses) {
    const JointFrames now = forward_kinematics(clip.skeleton, source_pose);
    Pose pose = followed_pose(skeleton, now, follows, away, aligned);
    if (!poses.empty()) {
      const Points& before = poses.back().rotations;
      for (Index j = 0; j < pose.rotations.rows(); ++j) {
        pose.rotations.row(j) = nearest_equivalent(pose.rotations.row(j), before.row(j));
      }
    }
    const Eigen::Vector3d hips = hip_middle(forward_kinematics(skeleton, pose).positions, to);
    pose.root_translation = scale * hip_middle(now.positions, from) - hips;
    poses.push_back(std::move(pose));
  }
  return poses;
}

// The part of a body that may touch the ground, as a small body: its soles and, for those who
// kneel, lie or stand on their hands, a sample of the rest.
BodyModel touching_part(const BodyModel& model, const ShapedBody& body) {
  const double floor = body.vertices.col(1).minCoeff();
  std::vector<Index> soles;
  for (Index v = 0; v < body.vertices.rows(); ++v) {
    if (body.vertices(v, 1) < floor + kSole) {
      soles.push_back(v);
    }
  }
  std::vector<Index> rows;
  const std::size_t sole_step = std::max<std::size_t>(1, 2 * soles.size() / kTouching);
  for (std::size_t i = 0; i < soles.size(); i += sole_step) {
    rows.push_back(soles[i]);
  }
  const Index step = std::max<Index>(1, 2 * body.vertices.rows() / kTouching);
  for (Index v = 0; v < body.vertices.rows(); v += step) {
    rows.push_back(v);
  }
  BodyModel part;
  part.skeleton = body.skeleton;
  const Index count = static_cast<Index>(rows.size());
  part.mesh.vertices.resize(count, 3);
  part.skin.joints.resize(count, model.skin.joints.cols());
  part.skin.weights.resize(count, model.skin.weights.cols());
  for (Index i = 0; i < count; ++i) {
    const Index row = rows[static_cast<std::size_t>(i)];
    part.mesh.vertices.row(i) = body.vertices.row(row);
    part.skin.joints.row(i) = model.skin.joints.row(row);
    part.skin.weights.row(i) = model.skin.weights.row(row);
  }
  return part;
}

// Height by which the body misses the ground: the lowest 5% of the frames' lowest points, so that
// jumps stay jumps.
double height_above_ground(const Motion& motion, const BodyModel& model, const ShapedBody& body) {
  const BodyModel part = touching_part(model, body);
  const ShapedBody shaped = shape_body(part);
  std::vector<double> lows;
  for (const Pose& pose : motion.poses) {
    lows.push_back(skin_vertices(part, shaped, pose).col(1).minCoeff());
  }
  std::sort(lows.begin(), lows.end());
  return lows.empty() ? 0 : lows[lows.size() / 20];
}

}  // namespace

OptionTable describe(RetargetOptions& options) {
  OptionTable table;
  table.add("fps", options.fps, 0, 1000, "1/s", "Frame rate of the result; 0: that of the clip");
  table.add("drop_t_pose", options.drop_t_pose,
            "Removal of a first frame that is a calibration pose");
  table.add("ground", options.ground, "Translation that puts the soles on y = 0");
  table.add("keep_contacts", options.keep_contacts,
            "Pinning of feet that stand still, the legs bent to reach them");
  table.add("contact_speed", options.contact_speed, 0, 5, "m/s",
            "Speed below which a foot near the ground is in contact; raise it for noisy motions");
  table.add("contact_height", options.contact_height, 0, 1, "m",
            "Maximum height above its lowest position at which a foot may be in contact");
  return table;
}

bool same_skeleton(const Skeleton& a, const Skeleton& b, double legs) {
  if (a.names != b.names || a.parents != b.parents || a.offsets.rows() != b.offsets.rows() ||
      !((a.offsets - b.offsets).cwiseAbs().maxCoeff() <= kSameLength * legs)) {
    return false;
  }
  for (Index j = 0; j < a.offsets.rows(); ++j) {
    const auto rest = [j](const Skeleton& skeleton) -> Eigen::Matrix3d {
      return skeleton.rest_rotations.rows() == 0 ? Eigen::Matrix3d::Identity().eval()
                                                 : rotation_matrix(skeleton.rest_rotations.row(j));
    };
    if (!rest(a).isApprox(rest(b), kSameLength)) {
      return false;
    }
  }
  return true;
}

Retargeted retarget(const MotionClip& original, const BodyModel& model,
                    const Eigen::VectorXd& shape, const RetargetOptions& options) {
  MotionClip clip = original;
  const Humanoid from = recognised_humanoid(clip.skeleton, clip.name);
  const ShapedBody body = shape_body(model, shape);
  const Skeleton& skeleton = body.skeleton;
  const Humanoid to = recognised_humanoid(skeleton, model.name);

  Retargeted result;
  const double clip_legs = checked_legs(clip.skeleton, from, clip.name);
  const double legs = checked_legs(skeleton, to, model.name);
  const bool own = same_skeleton(clip.skeleton, skeleton, legs);
  const bool t_pose = begins_with_t_pose(clip.motion);
  result.reference_frame = t_pose ? 0 : own ? -1 : reference_frame(clip, from, skeleton, to);
  const AlignmentReference reference =
      t_pose                       ? standing_reference(clip.skeleton, clip.motion.poses[0])
      : result.reference_frame < 0 ? standing_reference(clip.skeleton, rest_pose(clip.skeleton))
                                   : moving_reference(clip, from, result.reference_frame);
  if (t_pose && options.drop_t_pose) {
    clip.motion.poses.erase(clip.motion.poses.begin());
    clip.motion.frame_ids.erase(clip.motion.frame_ids.begin());
    result.findings.push_back({Severity::Note, "motion-t-pose", clip.name,
                               "the first frame is a calibration pose",
                               "it is left out; --retarget.drop-t-pose=false keeps it"});
  }
  if (options.fps > 0) {
    clip.motion = resampled(clip.motion, options.fps);
  }

  const std::vector<Eigen::Matrix3d> aligned = aligned_rotations(reference, from, skeleton, to);
  result.scale = own ? 1 : legs / clip_legs;
  add_scale_finding(clip_legs, legs, clip.name, result.findings);
  add_posture_finding(clip, from, result.findings);
  add_mirror_finding(clip, from, result.findings);

  result.motion.fps = clip.motion.fps;
  result.motion.frame_ids = clip.motion.frame_ids;
  result.motion.poses = own ? clip.motion.poses
                            : followed_poses(clip, from, skeleton, to, aligned,
                                             turned_away_from(reference, skeleton, to));
  result.contacts = foot_contacts(clip, from, options);
  if (options.keep_contacts && !own) {
    result.motion = with_pinned_feet(result.motion, skeleton, to, result.contacts);
  }
  if (options.ground) {
    const double height = height_above_ground(result.motion, model, body);
    for (Pose& pose : result.motion.poses) {
      pose.root_translation.y() -= height;
    }
  }
  return result;
}

}  // namespace atelier
