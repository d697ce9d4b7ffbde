#include "bodymodel/retarget/retarget_contacts.h"

#include <algorithm>
#include <cmath>

#include "bodymodel/kinematics.h"
#include "bodymodel/rotation.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kShortestPhase = 0.1;   // seconds
constexpr double kShortestGap = 0.07;    // seconds
constexpr double kFade = 0.2;            // seconds
constexpr double kFullStretch = 0.9995;  // of the leg's length: never quite straight

int contact_joint(const Leg& leg) {
  return leg.toe >= 0 ? leg.toe : leg.ankle;
}

// Runs of `value` shorter than `frames` are turned over, but not at both ends of the clip.
void drop_short_runs(std::vector<bool>& flags, bool value, std::size_t frames) {
  for (std::size_t begin = 0; begin < flags.size();) {
    std::size_t end = begin;
    while (end < flags.size() && flags[end] == flags[begin]) {
      ++end;
    }
    if (flags[begin] == value && end - begin < frames && begin > 0 && end < flags.size()) {
      std::fill(flags.begin() + static_cast<std::ptrdiff_t>(begin),
                flags.begin() + static_cast<std::ptrdiff_t>(end), !value);
    }
    begin = end;
  }
}

// One joint's correction over time: constant place within phases, faded outside.
std::vector<Eigen::Vector3d> corrections(const std::vector<Eigen::Vector3d>& path,
                                         const std::vector<bool>& stands, double fps) {
  const std::size_t count = path.size();
  std::vector<Eigen::Vector3d> result(count, Eigen::Vector3d::Zero());
  for (std::size_t begin = 0; begin < count;) {
    std::size_t end = begin;
    while (end < count && stands[end] == stands[begin]) {
      ++end;
    }
    if (stands[begin]) {
      Eigen::Vector3d place = Eigen::Vector3d::Zero();
      for (std::size_t i = begin; i < end; ++i) {
        place += path[i] / static_cast<double>(end - begin);
      }
      for (std::size_t i = begin; i < end; ++i) {
        result[i] = place - path[i];
        result[i].y() = 0;  // heights are the clip's: a heel may rise
      }
    }
    begin = end;
  }
  // Fade the ends of phases into the swing, the nearer one stronger.
  const std::size_t fade = std::max<std::size_t>(1, saturating_cast<std::size_t>(kFade * fps));
  std::vector<Eigen::Vector3d> faded = result;
  for (std::size_t i = 0; i < count; ++i) {
    if (stands[i]) {
      continue;
    }
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int way : {-1, 1}) {
      for (std::size_t k = 1; k <= fade; ++k) {
        const std::ptrdiff_t j =
            static_cast<std::ptrdiff_t>(i) + way * static_cast<std::ptrdiff_t>(k);
        if (j < 0 || j >= static_cast<std::ptrdiff_t>(count)) {
          break;
        }
        if (stands[static_cast<std::size_t>(j)]) {
          const double x = 1 - static_cast<double>(k) / static_cast<double>(fade + 1);
          sum += x * x * (3 - 2 * x) * result[static_cast<std::size_t>(j)];
          break;
        }
      }
    }
    faded[i] = sum;
  }
  return faded;
}

}  // namespace

std::vector<std::array<bool, 2>> foot_contacts(const MotionClip& clip, const Humanoid& person,
                                               const RetargetOptions& options) {
  const std::size_t count = clip.motion.poses.size();
  std::vector<std::array<bool, 2>> contacts(count, {false, false});
  if (count < 3) {
    return contacts;
  }
  std::vector<Points> joints;
  for (const Pose& pose : clip.motion.poses) {
    joints.push_back(forward_kinematics(clip.skeleton, pose).positions);
  }
  for (std::size_t side = 0; side < 2; ++side) {
    const int joint = contact_joint(person.legs[side]);
    std::vector<double> heights;
    for (const Points& frame : joints) {
      heights.push_back(frame(joint, 1));
    }
    std::vector<double> sorted = heights;
    std::sort(sorted.begin(), sorted.end());
    const double low = sorted[sorted.size() / 20];
    std::vector<bool> stands(count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t before = i > 0 ? i - 1 : i;
      const std::size_t after = i + 1 < count ? i + 1 : i;
      const double speed = (joints[after].row(joint) - joints[before].row(joint)).norm() *
                           clip.motion.fps / static_cast<double>(after - before);
      stands[i] = speed < options.contact_speed && heights[i] < low + options.contact_height;
    }
    drop_short_runs(stands, false,
                    saturating_cast<std::size_t>(kShortestGap * clip.motion.fps) + 1);
    drop_short_runs(stands, true,
                    saturating_cast<std::size_t>(kShortestPhase * clip.motion.fps) + 1);
    for (std::size_t i = 0; i < count; ++i) {
      contacts[i][side] = stands[i];
    }
  }
  return contacts;
}

Pose with_ankle_at(const Pose& pose, const Skeleton& skeleton, const Leg& leg,
                   const Eigen::Vector3d& ankle) {
  const JointFrames frames = forward_kinematics(skeleton, pose);
  const Eigen::Vector3d hip = frames.positions.row(leg.hip);
  const Eigen::Vector3d knee = frames.positions.row(leg.knee);
  const Eigen::Vector3d foot = frames.positions.row(leg.ankle);
  const Eigen::Vector3d thigh = knee - hip;
  const Eigen::Vector3d shin = foot - knee;
  const double a = thigh.norm();
  const double b = shin.norm();
  const double reach =
      std::clamp((ankle - hip).norm(), std::abs(a - b) + 1e-4 * (a + b), kFullStretch * (a + b));
  // The knee's hinge: normal of the leg's plane; for a straight leg, the knee's own x axis, which
  // is the left-right one in models that face +Z.
  Eigen::Vector3d hinge = cross_matrix(thigh) * shin;
  if (hinge.norm() < 1e-3 * a * b) {
    hinge = frames.rotations[static_cast<std::size_t>(leg.knee)].col(0);
    hinge -= hinge.dot(thigh) / (a * a) * thigh;
  }
  hinge.normalize();
  const double is = std::acos(std::clamp(thigh.dot(shin) / (a * b), -1.0, 1.0));
  const double wanted =
      std::acos(std::clamp((reach * reach - a * a - b * b) / (2 * a * b), -1.0, 1.0));
  const Eigen::Matrix3d bend = rotation_matrix((wanted - is) * hinge);
  const Eigen::Vector3d bent = hip + thigh + bend * shin;
  const Eigen::Matrix3d swing = rotation_between(bent - hip, ankle - hip);

  // World turns become rotations in the joints' own frames; the foot's turn is undone.
  Pose result = pose;
  const auto turn = [&](int joint, const Eigen::Matrix3d& by) {
    // R' = (frame before)^T by (frame before) R, where frame before R = frame
    const Eigen::Matrix3d own = rotation_matrix(pose.rotations.row(joint));
    const Eigen::Matrix3d before =
        frames.rotations[static_cast<std::size_t>(joint)] * own.transpose();
    const Eigen::Vector3d r = rotation_vector(before.transpose() * by * before * own);
    result.rotations.row(joint) = nearest_equivalent(r, pose.rotations.row(joint));
  };
  turn(leg.hip, swing);
  turn(leg.knee, bend);
  turn(leg.ankle, (swing * bend).transpose());
  return result;
}

Motion with_pinned_feet(const Motion& motion, const Skeleton& skeleton, const Humanoid& person,
                        const std::vector<std::array<bool, 2>>& contacts) {
  Motion result = motion;
  for (std::size_t side = 0; side < 2; ++side) {
    const Leg& leg = person.legs[side];
    std::vector<Eigen::Vector3d> path;
    std::vector<Eigen::Vector3d> ankles;
    std::vector<bool> stands;
    for (std::size_t i = 0; i < motion.poses.size(); ++i) {
      const Points joints = forward_kinematics(skeleton, result.poses[i]).positions;
      path.push_back(joints.row(contact_joint(leg)));
      ankles.push_back(joints.row(leg.ankle));
      stands.push_back(contacts[i][side]);
    }
    const std::vector<Eigen::Vector3d> moves = corrections(path, stands, motion.fps);
    for (std::size_t i = 0; i < motion.poses.size(); ++i) {
      if (moves[i].norm() > 1e-6) {
        result.poses[i] = with_ankle_at(result.poses[i], skeleton, leg, ankles[i] + moves[i]);
      }
    }
  }
  return result;
}

}  // namespace atelier
