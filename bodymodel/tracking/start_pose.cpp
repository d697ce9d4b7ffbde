#include "bodymodel/tracking/start_pose.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bodymodel/humanoid.h"
#include "bodymodel/rotation.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kGoodError = 0.03;    // m, median: no other reading is tried
constexpr int kFewest = 6;             // keypoints that make a pose
constexpr double kBent = 0.25;         // sine of a bend that says how the bone above is turned
constexpr double kSpeed = 4;           // m/s, spread of a joint's speed
constexpr double kFarJump = 9;         // squared spreads at which a jump costs no more
constexpr double kReadingPenalty = 6;  // cost of not taking names as they are
constexpr int kIterations = 25;

int place_of(const FittedPerson& person, const std::string& name) {
  const auto& names = person.places.names;
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? -1 : static_cast<int>(at - names.begin());
}

bool seen(const FittedPerson& person, const FrameTargets& targets, int k) {
  return k >= 0 && k < targets.keypoints.rows() && targets.deviations[k] > 0 &&
         person.places.riding.joints[static_cast<std::size_t>(k)] >= 0;
}

/// Turns joint `joint` of a pose by a rotation of the world about the joint.
void turn_in_world(const Skeleton& skeleton, int joint, const Eigen::Matrix3d& turn, Pose& pose,
                   const JointFrames& frames) {
  const Eigen::Matrix3d own = rotation_matrix(pose.rotations.row(joint));
  const Eigen::Matrix3d& world = frames.rotations[static_cast<std::size_t>(joint)];
  const Eigen::Matrix3d before = world * own.transpose();  // frame in which the pose turns
  Eigen::Vector3d vector = rotation_vector(before.transpose() * turn * world);
  if (skeleton.limits_min.rows() > 0 && joint > 0) {
    const Eigen::Vector3d middle =
        (skeleton.limits_min.row(joint) + skeleton.limits_max.row(joint)).transpose() / 2;
    vector = nearest_equivalent(vector, middle);
  }
  pose.rotations.row(joint) = vector.transpose();
}

struct Bone {
  int joint, end;           // joints of the skeleton
  int from, to, next;       // keypoints at its ends and at the end of the next bone, -1: none
  Eigen::Vector3d bending;  // way the next bone bends, in rest pose, world axes
};

std::vector<Bone> limb_bones(const FittedPerson& person) {
  const Humanoid who = recognised_humanoid(person.model->skeleton);
  std::vector<Bone> bones;
  for (std::size_t side = 0; side < 2; ++side) {
    const std::string prefix = side == 0 ? "left_" : "right_";
    const auto at = [&](const char* name) { return place_of(person, prefix + name); };
    const Leg& leg = who.legs[side];
    const Arm& arm = who.arms[side];
    const Eigen::Vector3d back = -Eigen::Vector3d::UnitZ();
    bones.push_back({leg.hip, leg.knee, at("hip"), at("knee"), at("ankle"), back});
    bones.push_back({leg.knee, leg.ankle, at("knee"), at("ankle"), at("big_toe"), -back});
    bones.push_back({arm.shoulder, arm.elbow, at("shoulder"), at("elbow"), at("wrist"), -back});
    bones.push_back({arm.elbow, arm.wrist, at("elbow"), at("wrist"), -1, back});
  }
  return bones;
}

std::string mirrored(const std::string& name) {
  if (name.starts_with("left_")) {
    return "right_" + name.substr(5);
  }
  return name.starts_with("right_") ? "left_" + name.substr(6) : name;
}

bool of_leg(const std::string& name) {
  return name.ends_with("hip") || name.ends_with("knee") || name.ends_with("ankle") ||
         name.ends_with("toe") || name.ends_with("heel");
}

bool of_head(const std::string& name) {
  return name.ends_with("eye") || name.ends_with("ear");
}

FrameTargets read_as(const FittedPerson& person, const FrameTargets& targets, SideReading reading) {
  FrameTargets result = targets;
  if (reading == SideReading::AsNamed) {
    return result;
  }
  for (Index k = 0; k < targets.keypoints.rows(); ++k) {
    const std::string& name = person.places.names[static_cast<std::size_t>(k)];
    const int other = place_of(person, mirrored(name));
    const bool leg = of_leg(name);
    const bool wanted = reading == SideReading::Mirrored ||
                        (reading == SideReading::LegsMirrored && leg) ||
                        (reading == SideReading::ArmsMirrored && !leg && !of_head(name));
    if (other >= 0 && other < targets.keypoints.rows() && wanted) {
      result.keypoints.row(k) = targets.keypoints.row(other);
      result.deviations[k] = targets.deviations[other];
    }
  }
  return result;
}

int count_seen(const FittedPerson& person, const FrameTargets& targets) {
  int count = 0;
  for (Index k = 0; k < targets.keypoints.rows(); ++k) {
    count += seen(person, targets, static_cast<int>(k)) ? 1 : 0;
  }
  return count;
}

/// Distance that a share of the keypoints seen does not exceed.
double error_of_share(const FittedPerson& person, const FrameTargets& targets,
                      const Eigen::VectorXd& x, double share) {
  const JointFrames frames =
      forward_kinematics(person.shaped.skeleton, pose_of_variables(person, x));
  std::vector<double> errors;
  for (Index k = 0; k < targets.keypoints.rows(); ++k) {
    if (seen(person, targets, static_cast<int>(k))) {
      const int joint = person.places.riding.joints[static_cast<std::size_t>(k)];
      const Eigen::Vector3d offset = person.places.riding.offsets.row(k);
      errors.push_back((frames.positions.row(joint).transpose() +
                        frames.rotations[static_cast<std::size_t>(joint)] * offset -
                        targets.keypoints.row(k).transpose())
                           .norm());
    }
  }
  if (errors.empty()) {
    return std::numeric_limits<double>::infinity();
  }
  const auto place = errors.begin() + saturating_cast<std::ptrdiff_t>(
                                          share * static_cast<double>(errors.size() - 1));
  std::nth_element(errors.begin(), place, errors.end());
  return *place;
}

/// One reading of a frame, posed.
struct Hypothesis {
  StartPose start;
  double cost = 0;
  Eigen::VectorXd joints;
};

std::vector<Hypothesis> hypotheses(const FittedPerson& person, const FrameTargets& targets,
                                   const FrameWeights& weights) {
  std::vector<Hypothesis> all;
  if (count_seen(person, targets) < kFewest) {
    return all;
  }
  FrameWeights rough = weights;  // a first pose may be far from what is seen
  rough.keypoint = std::max(weights.keypoint, 0.015);
  rough.keypoint_outlier = std::max(weights.keypoint_outlier, 0.15);
  for (const SideReading reading : {SideReading::AsNamed, SideReading::Mirrored,
                                    SideReading::LegsMirrored, SideReading::ArmsMirrored}) {
    Hypothesis one;
    one.start.reading = reading;
    one.start.targets = read_as(person, targets, reading);
    const std::optional<Eigen::VectorXd> closed = closed_form_pose(person, one.start.targets);
    if (!closed) {
      continue;
    }
    TrackWindow window{{&one.start.targets}, {0}, {*closed}};
    one.start.x = solve_window(person, window, rough, {}, kIterations).x[0];
    one.start.error = error_of_share(person, one.start.targets, one.start.x, 0.5);
    one.start.trusted = one.start.error < kUntrustedError;
    one.cost = frame_energy(person, one.start.targets, one.start.x, rough, false).cost +
               (reading == SideReading::AsNamed ? 0 : kReadingPenalty);
    one.joints = sought_joints(person, one.start.x);
    const bool good = reading == SideReading::AsNamed &&
                      error_of_share(person, one.start.targets, one.start.x, 0.8) < kGoodError;
    all.push_back(std::move(one));
    if (good) {
      break;
    }
  }
  return all;
}

double jump(const Hypothesis& a, const Hypothesis& b, double seconds) {
  const Index joints = a.joints.size() / 3;
  double sum = 0;
  for (Index j = 0; j < joints; ++j) {
    const double far = (a.joints.segment<3>(3 * j) - b.joints.segment<3>(3 * j)).norm();
    const double spreads = far / (kSpeed * seconds + 0.03);
    sum += std::min(spreads * spreads, kFarJump);
  }
  return 0.5 * sum;
}

/// The best reading of every frame that has some, chosen together.
std::vector<std::size_t> best_readings(const std::vector<std::vector<Hypothesis>>& all,
                                       const std::vector<double>& times) {
  std::vector<std::size_t> chosen(all.size(), 0);
  std::vector<std::vector<double>> cost(all.size());
  std::vector<std::vector<std::size_t>> from(all.size());
  std::vector<std::size_t> chain;  // frames that have readings
  for (std::size_t f = 0; f < all.size(); ++f) {
    for (std::size_t h = 0; h < all[f].size(); ++h) {
      double best = 0;
      std::size_t back = 0;
      if (!chain.empty()) {
        best = std::numeric_limits<double>::infinity();
        const std::size_t p = chain.back();
        for (std::size_t g = 0; g < all[p].size(); ++g) {
          const double sum = cost[p][g] + jump(all[p][g], all[f][h], times[f] - times[p]);
          if (sum < best) {
            best = sum;
            back = g;
          }
        }
      }
      cost[f].push_back(best + all[f][h].cost);
      from[f].push_back(back);
    }
    if (!all[f].empty()) {
      chain.push_back(f);
    }
  }
  for (std::size_t i = chain.size(); i-- > 0;) {
    const std::size_t f = chain[i];
    chosen[f] = i + 1 == chain.size()
                    ? static_cast<std::size_t>(std::min_element(cost[f].begin(), cost[f].end()) -
                                               cost[f].begin())
                    : from[chain[i + 1]][chosen[chain[i + 1]]];
  }
  return chosen;
}

/// Poses between those of the nearest trusted frames, along the shortest way of every joint.
void bridge(const std::vector<double>& times, std::vector<StartPose>& starts) {
  const auto nearest = [&](std::size_t f, int step) {
    for (auto g = static_cast<std::ptrdiff_t>(f); g >= 0 && g < std::ssize(starts); g += step) {
      if (starts[static_cast<std::size_t>(g)].trusted) {
        return g;
      }
    }
    return std::ptrdiff_t{-1};
  };
  for (std::size_t f = 0; f < starts.size(); ++f) {
    if (starts[f].trusted) {
      continue;
    }
    std::ptrdiff_t before = nearest(f, -1);
    std::ptrdiff_t after = nearest(f, 1);
    if (before < 0 && after < 0) {
      return;
    }
    before = before < 0 ? after : before;
    after = after < 0 ? before : after;
    const Eigen::VectorXd& a = starts[static_cast<std::size_t>(before)].x;
    const Eigen::VectorXd& b = starts[static_cast<std::size_t>(after)].x;
    const double span =
        times[static_cast<std::size_t>(after)] - times[static_cast<std::size_t>(before)];
    const double t = span > 0 ? (times[f] - times[static_cast<std::size_t>(before)]) / span : 0;
    Eigen::VectorXd x = a + t * (b - a);
    for (Index i = 3; i < x.size(); i += 3) {
      const Eigen::Matrix3d from = rotation_matrix(a.segment<3>(i));
      const Eigen::Vector3d way =
          rotation_vector(from.transpose() * rotation_matrix(b.segment<3>(i)));
      x.segment<3>(i) =
          nearest_equivalent(rotation_vector(from * rotation_matrix(t * way)), a.segment<3>(i));
    }
    starts[f].x = x;
  }
}

}  // namespace

std::optional<Eigen::VectorXd> closed_form_pose(const FittedPerson& person,
                                                const FrameTargets& targets) {
  ATELIER_CHECK(targets.keypoints.rows() == targets.deviations.size(),
                "one deviation for each keypoint");
  const Skeleton& skeleton = person.shaped.skeleton;
  Pose pose = rest_pose(skeleton);
  JointFrames frames = forward_kinematics(skeleton, pose);
  // The trunk.
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> pairs;  // of rest and seen
  for (const char* name :
       {"left_hip", "right_hip", "left_shoulder", "right_shoulder", "neck", "mid_hip"}) {
    const int k = place_of(person, name);
    if (seen(person, targets, k)) {
      const int joint = person.places.riding.joints[static_cast<std::size_t>(k)];
      const Eigen::Vector3d offset = person.places.riding.offsets.row(k);
      pairs.emplace_back(frames.positions.row(joint).transpose() +
                             frames.rotations[static_cast<std::size_t>(joint)] * offset,
                         targets.keypoints.row(k).transpose());
    }
  }
  if (pairs.size() < 3) {
    return std::nullopt;
  }
  Eigen::Vector3d middle_rest = Eigen::Vector3d::Zero();
  Eigen::Vector3d middle_seen = Eigen::Vector3d::Zero();
  for (const auto& [from, to] : pairs) {
    middle_rest += from / static_cast<double>(pairs.size());
    middle_seen += to / static_cast<double>(pairs.size());
  }
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  for (const auto& [from, to] : pairs) {
    cross += (to - middle_seen) * (from - middle_rest).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  constexpr double kThin = 1e-3;  // m2: points in line tell no rotation about it
  if (svd.singularValues()[1] < kThin) {
    return std::nullopt;
  }
  Eigen::Matrix3d flip = Eigen::Matrix3d::Identity();
  flip(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  const Eigen::Matrix3d turn = svd.matrixU() * flip * svd.matrixV().transpose();
  turn_in_world(skeleton, 0, turn, pose, frames);
  const Eigen::Vector3d root = frames.positions.row(0).transpose();
  pose.root_translation = turn * (root - middle_rest) + middle_seen - root;

  const JointFrames at_rest = frames;
  for (const Bone& bone : limb_bones(person)) {
    if (!seen(person, targets, bone.to)) {
      continue;
    }
    frames = forward_kinematics(skeleton, pose);
    const Eigen::Vector3d end = targets.keypoints.row(bone.to).transpose();
    const Eigen::Vector3d begin = seen(person, targets, bone.from)
                                      ? Eigen::Vector3d(targets.keypoints.row(bone.from))
                                      : Eigen::Vector3d(frames.positions.row(bone.joint));
    const Eigen::Vector3d along =
        (frames.positions.row(bone.end) - frames.positions.row(bone.joint)).transpose();
    const Eigen::Vector3d wanted = end - begin;
    if (wanted.norm() < 1e-6 || along.norm() < 1e-6) {
      continue;
    }
    Eigen::Matrix3d swing = rotation_between(along, wanted);
    if (seen(person, targets, bone.next)) {
      const Eigen::Vector3d axis = wanted.normalized();
      Eigen::Vector3d next = (targets.keypoints.row(bone.next).transpose() - end).normalized();
      next -= next.dot(axis) * axis;
      const auto joint = static_cast<std::size_t>(bone.joint);
      Eigen::Vector3d bending =
          swing * frames.rotations[joint] * at_rest.rotations[joint].transpose() * bone.bending;
      bending -= bending.dot(axis) * axis;
      if (next.norm() > kBent && bending.norm() > kBent) {
        const double angle = std::atan2(axis.dot(bending.cross(next)), bending.dot(next));
        swing = rotation_matrix(angle * axis) * swing;
      }
    }
    turn_in_world(skeleton, bone.joint, swing, pose, frames);
  }
  return pose_variables(person, pose);
}

std::vector<StartPose> start_poses(const FittedPerson& person,
                                   const std::vector<FrameTargets>& frames,
                                   const std::vector<double>& times, const FrameWeights& weights) {
  ATELIER_CHECK(frames.size() == times.size(), "a time for each frame");
  std::vector<std::vector<Hypothesis>> all(frames.size());
  parallel_for(static_cast<Index>(frames.size()), 1, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      const auto i = static_cast<std::size_t>(f);
      all[i] = hypotheses(person, frames[i], weights);
    }
  });
  const std::vector<std::size_t> chosen = best_readings(all, times);
  const Eigen::VectorXd rest = pose_variables(person, rest_pose(person.shaped.skeleton));
  std::vector<StartPose> starts(frames.size());
  for (std::size_t f = 0; f < frames.size(); ++f) {
    if (!all[f].empty()) {
      starts[f] = all[f][chosen[f]].start;
    }
    if (!starts[f].trusted) {
      starts[f].x = rest;
      starts[f].targets = frames[f];
      starts[f].targets.deviations.setZero();
      starts[f].reading = SideReading::AsNamed;
    }
  }
  bridge(times, starts);
  return starts;
}

}  // namespace atelier
