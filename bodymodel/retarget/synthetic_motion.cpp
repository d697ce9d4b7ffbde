#include "bodymodel/retarget/synthetic_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "bodymodel/formats/motion_file.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/rotation.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/nearest_name.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

constexpr double kPi = std::numbers::pi;

/// A body's pose at one moment, in anatomical angles [rad], sides left and right.
struct Stance {
  double thigh[2] = {0, 0};         ///< forward
  double spread[2] = {0.07, 0.07};  ///< thighs outward
  double knee[2] = {0.05, 0.05};    ///< bent
  double arm[2] = {0, 0};           ///< upper arm forward
  double lift[2] = {0.28, 0.28};    ///< upper arm outward from hanging; pi: straight up
  double elbow[2] = {0.25, 0.25};   ///< bent
  double lean = 0;                  ///< trunk forward
  double twist = 0;                 ///< shoulders against hips, to the left
  double yaw = 0;                   ///< the whole body, to the left
  bool feet_stay = true;            ///< ankles keep their place in the plane
};

/// Direction outward/forward from hanging down.
Eigen::Vector3d limb(double side, double outward, double forward) {
  return Eigen::AngleAxisd(-forward, Eigen::Vector3d::UnitX()) *
         Eigen::Vector3d(side * std::sin(outward), -std::cos(outward), 0);
}

/// Turns stances into poses of one body.
struct Poser {
  BodyModel model;
  ShapedBody body;
  Humanoid person;
  Points joints;  ///< rest
  std::vector<Eigen::Matrix3d> rest;
  double ground = 0;
  double min_lift = 0;  ///< of the upper arms, for arms that hang clear of the trunk

  Poser(const BodyModel& m, double ground_)
      : model(m),
        body(shape_body(m)),
        person(recognised_humanoid(m.skeleton)),
        joints(rest_positions(m.skeleton)),
        rest(forward_kinematics(m.skeleton, rest_pose(m.skeleton)).rotations),
        ground(ground_) {
    model.correctives.clear();  // only where the feet stand is asked
  }

  Eigen::Vector3d at(int joint) const { return joints.row(joint).transpose(); }

  void turn(Pose& pose, int joint, const Eigen::Matrix3d& by) const {
    const Eigen::Matrix3d& g = rest[static_cast<std::size_t>(joint)];
    pose.rotations.row(joint) = rotation_vector(g.transpose() * by * g).transpose();
  }

  Pose pose(Stance stance) const {
    for (double& lift : stance.lift) {
      lift = std::max(lift, min_lift);
    }
    Pose pose = rest_pose(model.skeleton);
    const Eigen::Matrix3d facing =
        Eigen::AngleAxisd(stance.yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    turn(pose, 0, facing);
    const auto spine = static_cast<double>(person.spine.size());
    const auto begin = person.spine.size() > 1 ? person.spine.begin() + 1 : person.spine.begin();
    const double share = 1 / std::max(1.0, spine - 1);
    for (auto joint = begin; joint != person.spine.end() && *joint != 0; ++joint) {
      turn(pose, *joint,
           (Eigen::AngleAxisd(share * stance.twist, Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(share * stance.lean, Eigen::Vector3d::UnitX()))
               .toRotationMatrix());
    }
    turn(pose, person.neck.front(),
         (Eigen::AngleAxisd(-0.5 * stance.lean, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(-0.4 * stance.twist, Eigen::Vector3d::UnitY()))
             .toRotationMatrix());
    for (std::size_t s = 0; s < 2; ++s) {
      const double side = s == 0 ? 1 : -1;
      const Leg& leg = person.legs[s];
      const Eigen::Matrix3d hip = rotation_between(at(leg.knee) - at(leg.hip),
                                                   limb(side, stance.spread[s], stance.thigh[s]));
      const Eigen::Matrix3d knee = rotation_between(
          at(leg.ankle) - at(leg.knee),
          hip.transpose() * limb(side, 0.5 * stance.spread[s], stance.thigh[s] - stance.knee[s]));
      turn(pose, leg.hip, hip);
      turn(pose, leg.knee, knee);
      turn(pose, leg.ankle, (hip * knee).transpose());
      const Arm& arm = person.arms[s];
      // Collars share a raised arm, as shoulders do.
      const double raised = std::max(0.0, stance.lift[s] - 1.2);
      const Eigen::Matrix3d collar =
          Eigen::AngleAxisd(side * 0.3 * raised, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      if (arm.collar >= 0) {
        turn(pose, arm.collar, collar);
      }
      const Eigen::Vector3d upper = limb(side, stance.lift[s], stance.arm[s]);
      const Eigen::Vector3d bent =
          (upper * std::cos(stance.elbow[s]) +
           std::sin(stance.elbow[s]) * (Eigen::Vector3d::UnitZ() - upper * upper.z()).normalized())
              .normalized();
      const Eigen::Matrix3d basis =
          arm.collar >= 0 ? collar : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
      const Eigen::Matrix3d shoulder =
          rotation_between(at(arm.elbow) - at(arm.shoulder), basis.transpose() * upper);
      turn(pose, arm.shoulder, shoulder);
      turn(pose, arm.elbow,
           rotation_between(at(arm.wrist) - at(arm.elbow), (basis * shoulder).transpose() * bent));
    }
    return grounded(pose, stance.feet_stay);
  }

  /// Feet on the ground and, where they should stay, where they are in the rest pose.
  Pose grounded(Pose pose, bool feet_stay) const {
    if (feet_stay) {
      const JointFrames frames = forward_kinematics(model.skeleton, pose);
      const auto middle = [&](const Points& points) {
        return Eigen::Vector3d(
            (points.row(person.legs[0].ankle) + points.row(person.legs[1].ankle)) / 2);
      };
      Eigen::Vector3d shift = middle(joints) - middle(frames.positions);
      shift.y() = 0;
      pose.root_translation += shift;
    }
    const Points vertices = skin_vertices(model, body, pose, {.correctives = false});
    pose.root_translation.y() += ground - vertices.col(1).minCoeff();
    return pose;
  }
};

/// Rows of the trunk and of the arms from the middle of the upper arm on: nearer to the armpit skin
/// always folds.
struct TrunkAndArms {
  std::vector<Index> trunk, arms;
};

TrunkAndArms trunk_and_arms(const Poser& poser) {
  const Skeleton& skeleton = poser.model.skeleton;
  std::vector<int> side(skeleton.names.size(),
                        -1);  // 0 or 1: that arm's shoulder or what hangs on it
  for (std::size_t j = 0; j < side.size(); ++j) {
    const int parent = skeleton.parents[j];
    side[j] = parent >= 0 ? side[static_cast<std::size_t>(parent)] : -1;
    for (int s = 0; s < 2; ++s) {
      side[j] = static_cast<int>(j) == poser.person.arms[static_cast<std::size_t>(s)].shoulder
                    ? s
                    : side[j];
    }
  }
  std::vector<bool> on_trunk(skeleton.names.size(), false);
  for (const int joint : poser.person.spine) {
    on_trunk[static_cast<std::size_t>(joint)] = true;
  }
  TrunkAndArms rows;
  const BodyModel& model = poser.model;
  for (Index v = 0; v < vertex_count(model); ++v) {
    double trunk = 0;
    double arm = 0;
    int s = 0;
    for (Index k = 0; k < model.skin.joints.cols(); ++k) {
      const auto joint = static_cast<std::size_t>(model.skin.joints(v, k));
      trunk += on_trunk[joint] ? model.skin.weights(v, k) : 0;
      if (side[joint] >= 0) {
        arm += model.skin.weights(v, k);
        s = side[joint];
      }
    }
    if (trunk > 0.8) {
      rows.trunk.push_back(v);
    } else if (arm > 0.95) {
      const Arm& limb = poser.person.arms[static_cast<std::size_t>(s)];
      const Eigen::Vector3d along = poser.at(limb.elbow) - poser.at(limb.shoulder);
      const Eigen::Vector3d place =
          model.mesh.vertices.row(v).transpose() - poser.at(limb.shoulder);
      if (place.dot(along) > 0.5 * along.squaredNorm()) {
        rows.arms.push_back(v);
      }
    }
  }
  return rows;
}

/// How far the arms are off the trunk, m; negative inside.
double clearance(const Poser& poser, const TrunkAndArms& rows, const Pose& pose) {
  const Points vertices = skin_vertices(poser.model, poser.body, pose, {.correctives = false});
  const Points normals = vertex_normals(vertices, poser.model.mesh.faces);
  std::vector<double> off(rows.arms.size(), 1e9);
  parallel_for(static_cast<Index>(off.size()), 64, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const Eigen::RowVector3d p = vertices.row(rows.arms[static_cast<std::size_t>(i)]);
      double least = 1e9;
      Index nearest = 0;
      for (const Index q : rows.trunk) {
        const double d = (vertices.row(q) - p).squaredNorm();
        if (d < least) {
          least = d;
          nearest = q;
        }
      }
      const double along = (p - vertices.row(nearest)).dot(normals.row(nearest));
      off[static_cast<std::size_t>(i)] = std::copysign(std::sqrt(least), along);
    }
  });
  return off.empty() ? 1e9 : *std::min_element(off.begin(), off.end());
}

Stance stance_of(const std::string& motion, double t) {
  Stance stance;
  const double wave = 0.5 - 0.5 * std::cos(2 * kPi * std::clamp(t, 0.0, 1.0));
  if (motion == "stride") {
    const double phase = 2 * kPi * t;
    const double strength = std::min({1.0, eased(4 * t), eased(4 * (1.25 - t))});
    for (std::size_t s = 0; s < 2; ++s) {
      const double p = phase + (s == 0 ? 0 : kPi);
      stance.thigh[s] = strength * (0.42 * std::sin(p) + 0.06);
      stance.knee[s] = 0.08 + strength * (0.85 * std::max(0.0, std::cos(p - 0.35)));
      stance.arm[s] = -0.45 * strength * std::sin(p);
      stance.elbow[s] = 0.3 + 0.25 * strength;
      stance.lift[s] = 0.24;
    }
    stance.lean = 0.05;
    stance.twist = -0.12 * strength * std::sin(phase);
    stance.feet_stay = false;
  } else if (motion == "squat") {
    for (std::size_t s = 0; s < 2; ++s) {
      stance.thigh[s] = 1.25 * wave;
      stance.spread[s] = 0.12 + 0.16 * wave;
      stance.knee[s] = 0.05 + 1.75 * wave;
      stance.arm[s] = 1.25 * wave;
    }
    stance.lean = 0.55 * wave;
  } else if (motion == "raise") {
    for (std::size_t s = 0; s < 2; ++s) {
      stance.lift[s] = 0.28 + 2.35 * wave;
      stance.elbow[s] = 0.15;
    }
  } else if (motion == "twist") {
    stance.twist = 0.75 * std::sin(2 * kPi * t) * std::min(1.0, eased(4 * t));
    for (std::size_t s = 0; s < 2; ++s) {
      stance.lift[s] = 0.28 + 0.75 * eased(3 * t);
      stance.elbow[s] = 0.5;
      stance.spread[s] = 0.16;
    }
  } else if (motion == "spin") {
    stance.yaw = 2 * kPi * eased(t);
    for (std::size_t s = 0; s < 2; ++s) {
      const double step = std::max(0.0, std::sin(4 * kPi * t + (s == 0 ? 0 : kPi)));
      stance.lift[s] = 0.28 + 0.6 * wave;
      stance.knee[s] = 0.08 + 0.35 * wave * step;
      stance.thigh[s] = 0.18 * wave * step;
      stance.spread[s] = 0.11;
    }
    stance.feet_stay = false;
  } else {  // range: what a person shows so that a body can be measured
    const double a = std::clamp(t, 0.0, 1.0);
    const double bend = std::max(0.0, std::sin(2 * kPi * (a - 0.4)));
    for (std::size_t s = 0; s < 2; ++s) {
      stance.lift[s] = 0.7 + 1.5 * std::sin(kPi * a);
      stance.arm[s] = 0.35 * std::sin(2 * kPi * a);
      stance.elbow[s] = 0.15 + 0.9 * std::max(0.0, std::sin(2 * kPi * a));
      stance.thigh[s] = 0.75 * bend;
      stance.knee[s] = 0.05 + 1.1 * bend;
      stance.spread[s] = 0.2;
    }
    stance.lean = 0.25 * bend;
    stance.twist = 0.4 * std::sin(2 * kPi * a);
  }
  return stance;
}

/// The least lift of the upper arms, up to 0.8, at which they stay clear of the trunk over a
/// motion: on a stout body arms would hang in it, and no cloth has a place where a body overlaps
/// itself.
double lift_clear_of_trunk(Poser poser, const std::string& motion) {
  constexpr double kClear = 0.015;  // m, room for cloth
  constexpr int kPlaces = 9;        // of the motion that are looked at
  const TrunkAndArms rows = trunk_and_arms(poser);
  poser.min_lift = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const Stance stance = stance_of(motion, (i + 0.5) / kPlaces);
    while (poser.min_lift < 0.8 && clearance(poser, rows, poser.pose(stance)) < kClear) {
      poser.min_lift = std::max(poser.min_lift, std::min(stance.lift[0], stance.lift[1])) + 0.04;
    }
  }
  return poser.min_lift;
}

ContinuousMotion file_motion(const BodyModel& model, const std::string& path, double ground) {
  constexpr double kRate = 120;  // poses a second between which is interpolated
  const MotionClip clip = read_motion_file(path, of_body(model));
  RetargetOptions options;
  options.fps = kRate;
  const Retargeted moved = retarget(clip, model, {}, options);
  auto poses = std::make_shared<std::vector<Pose>>(moved.motion.poses);
  if (poses->empty()) {
    throw DataError(path, "", "no frames", "a motion with at least one frame");
  }
  for (Pose& pose : *poses) {
    pose.root_translation.y() += ground;
  }
  ContinuousMotion motion;
  motion.findings = clip.findings;
  motion.findings.insert(motion.findings.end(), moved.findings.begin(), moved.findings.end());
  motion.duration = static_cast<double>(poses->size() - 1) / kRate;
  motion.pose = [poses](double seconds) {
    const double x = std::clamp(seconds * kRate, 0.0, static_cast<double>(poses->size() - 1));
    const auto i = saturating_cast<std::size_t>(x);
    const std::size_t next = std::min(i + 1, poses->size() - 1);
    Pose to = (*poses)[next];
    for (Index j = 0; j < to.rotations.rows(); ++j) {
      to.rotations.row(j) = nearest_equivalent(to.rotations.row(j).transpose(),
                                               (*poses)[i].rotations.row(j).transpose())
                                .transpose();
    }
    return blended((*poses)[i], to, x - static_cast<double>(i));
  };
  return motion;
}

/// From the right hip to the left one, along the ground.
Eigen::Vector3d across_hips(const Humanoid& person, const Points& joints) {
  Eigen::Vector3d across =
      (joints.row(person.legs[0].hip) - joints.row(person.legs[1].hip)).transpose();
  across.y() = 0;
  return across;
}

}  // namespace

double eased(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * t * (t * (6 * t - 15) + 10);
}

double transition_seconds(const Skeleton& skeleton, const Pose& from, const Pose& to) {
  constexpr double kLeast = 0.9;     // s
  constexpr double kQuickest = 2.0;  // m/s
  constexpr double kSlope = 1.875;   // of eased(), half way, where the quickest joint is
  const Points way =
      forward_kinematics(skeleton, to).positions - forward_kinematics(skeleton, from).positions;
  return std::max(kLeast, kSlope * std::sqrt(way.rowwise().squaredNorm().maxCoeff()) / kQuickest);
}

const std::vector<std::string>& procedural_motions() {
  static const std::vector<std::string> names = {"stride", "squat", "raise",
                                                 "twist",  "spin",  "range"};
  return names;
}

bool is_procedural(const std::string& motion) {
  const std::vector<std::string>& names = procedural_motions();
  return std::find(names.begin(), names.end(), motion) != names.end();
}

OptionTable describe(MotionChoice& choice) {
  OptionTable table;
  table
      .add(
          "motion", choice.motion, std::vector<std::string>{},
          "Motion: auto, stride, squat, raise, twist, spin, range, or a file (BVH, AMASS npz, ...)")
      .add("duration", choice.duration, 0.2, 60, "s",
           "Duration of one repetition of a built-in motion, such as a pair of strides or a squat")
      .add("start", choice.start, -1, 1e6, "s",
           "Time in the motion of the first frame; below 0: so that the frames are centred in the "
           "motion");
  return table;
}

ContinuousMotion facing_as_at_rest(const BodyModel& model, const ContinuousMotion& motion,
                                   double entry) {
  return facing_as(model, motion, entry, rest_pose(model.skeleton));
}

ContinuousMotion facing_as(const BodyModel& model, const ContinuousMotion& motion, double entry,
                           const Pose& standing) {
  const Humanoid person = recognised_humanoid(model.skeleton);
  const JointFrames rest = forward_kinematics(model.skeleton, rest_pose(model.skeleton));
  const JointFrames wanted = forward_kinematics(model.skeleton, standing);
  const JointFrames then = forward_kinematics(model.skeleton, motion.pose(entry));
  const Eigen::Vector3d to = across_hips(person, wanted.positions);
  const Eigen::Vector3d from = across_hips(person, then.positions);
  // Lying on the side hips have no direction along the ground.
  const double angle = from.norm() < 1e-3
                           ? 0
                           : std::atan2(from.cross(to).dot(Eigen::Vector3d::UnitY()), from.dot(to));
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d root = rest.positions.row(0).transpose();
  Eigen::Vector3d shift =
      wanted.positions.row(0).transpose() - turn * then.positions.row(0).transpose();
  shift.y() = 0;
  const Eigen::Matrix3d basis = rest.rotations.front();
  return {[pose_of = motion.pose, turn, shift, basis, root](double seconds) {
            Pose pose = pose_of(seconds);
            pose.root_translation = turn * (root + pose.root_translation) + shift - root;
            const Eigen::Matrix3d turned = basis.transpose() * turn * basis *
                                           rotation_matrix(pose.rotations.row(0).transpose());
            pose.rotations.row(0) = rotation_vector(turned).transpose();
            return pose;
          },
          motion.duration, motion.findings};
}

Pose blended(const Pose& from, const Pose& to, double share) {
  Pose pose = from;
  pose.root_translation += share * (to.root_translation - from.root_translation);
  pose.rotations += share * (to.rotations - from.rotations);
  return pose;
}

ContinuousMotion continuous_motion(const BodyModel& model, const std::string& motion,
                                   double duration, double ground) {
  if (!is_procedural(motion)) {
    if (!std::filesystem::path(motion).has_extension() && !std::filesystem::exists(motion)) {
      throw UnknownValue("", "motion", motion,
                         "stride, squat, raise, twist, spin, range, or a file" +
                             did_you_mean(motion, procedural_motions()));
    }
    return file_motion(model, motion, ground);
  }
  auto poser = std::make_shared<Poser>(model, ground);
  poser->min_lift = lift_clear_of_trunk(*poser, motion);
  return {[poser, motion, duration](double seconds) {
            return poser->pose(stance_of(motion, seconds / duration));
          },
          duration};
}

}  // namespace atelier
