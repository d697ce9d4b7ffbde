#include "bodymodel/retarget/retarget_align.h"

#include <algorithm>
#include <cmath>

#include "bodymodel/retarget/motion_resample.h"
#include "bodymodel/rotation.h"

namespace atelier {
namespace {

constexpr int kMaxCandidates = 200;  // frames looked at for a reference
constexpr double kRestIsFine = 0.6;  // radians a bone: T-, A- and I-poses are this near
constexpr double kUpright = 0.8;     // cosine to the vertical

Eigen::Vector3d direction(const Points& joints, int from, int to) {
  return (joints.row(to) - joints.row(from)).normalized().transpose();
}

Eigen::Vector3d middle(const Points& joints, int a, int b) {
  return 0.5 * (joints.row(a) + joints.row(b)).transpose();
}

Eigen::Matrix3d axes(const Eigen::Vector3d& left, const Eigen::Vector3d& up) {
  Eigen::Matrix3d frame;
  frame.col(1) = up.normalized();
  frame.col(0) = (left - left.dot(frame.col(1)) * frame.col(1)).normalized();
  const Eigen::Vector3d x = frame.col(0);
  const Eigen::Vector3d y = frame.col(1);
  frame.col(2) = cross_matrix(x) * y;
  return frame;
}

// Directions of the eight long bones in the axes of the hips.
Eigen::Matrix<double, 3, 8> limb_directions(const Points& joints, const Humanoid& person) {
  const Eigen::Matrix3d inverse = pelvis_axes(joints, person).transpose();
  Eigen::Matrix<double, 3, 8> directions;
  for (int side = 0; side < 2; ++side) {
    const Leg& leg = person.legs[static_cast<std::size_t>(side)];
    const Arm& arm = person.arms[static_cast<std::size_t>(side)];
    directions.col(4 * side) = inverse * direction(joints, leg.hip, leg.knee);
    directions.col(4 * side + 1) = inverse * direction(joints, leg.knee, leg.ankle);
    directions.col(4 * side + 2) = inverse * direction(joints, arm.shoulder, arm.elbow);
    directions.col(4 * side + 3) = inverse * direction(joints, arm.elbow, arm.wrist);
  }
  return directions;
}

double mean_angle(const Eigen::Matrix<double, 3, 8>& a, const Eigen::Matrix<double, 3, 8>& b) {
  double sum = 0;
  for (int i = 0; i < 8; ++i) {
    sum += std::acos(std::clamp(a.col(i).dot(b.col(i)), -1.0, 1.0));
  }
  return sum / 8;
}

// Where along a chain its joints are, 0 to 1, by length; by number if it has none.
std::vector<double> shares(const Skeleton& skeleton, const std::vector<int>& chain) {
  std::vector<double> result(chain.size(), 0);
  for (std::size_t i = 1; i < chain.size(); ++i) {
    result[i] = result[i - 1] + skeleton.offsets.row(chain[i]).norm();
  }
  const double whole = result.back();
  for (std::size_t i = 0; i < chain.size() && chain.size() > 1; ++i) {
    result[i] = whole > 0 ? result[i] / whole
                          : static_cast<double>(i) / static_cast<double>(chain.size() - 1);
  }
  return result;
}

void follow_chain(const Skeleton& source, const std::vector<int>& from, const Skeleton& target,
                  const std::vector<int>& to, std::vector<Follow>& follows) {
  const std::vector<double> knots = shares(source, from);
  const std::vector<double> places = shares(target, to);
  for (std::size_t i = 0; i < to.size(); ++i) {
    std::size_t k = 0;
    while (k + 2 < knots.size() && knots[k + 1] < places[i]) {
      ++k;
    }
    const std::size_t next = std::min(k + 1, knots.size() - 1);
    const double width = knots[next] - knots[k];
    const double share = width > 0 ? std::clamp((places[i] - knots[k]) / width, 0.0, 1.0) : 0;
    follows[static_cast<std::size_t>(to[i])] = {from[k], from[next], share};
  }
}

// The level part of a direction; y is up.
Eigen::Vector3d level(const Eigen::Vector3d& d) {
  return {d.x(), 0, d.z()};
}

// The turn about the vertical that takes +Z where `turn` takes it, as far as it can.
Eigen::Matrix3d heading_of(const Eigen::Matrix3d& turn) {
  const Eigen::Vector3d front = level(turn.col(2));
  return front.norm() > 0.1 ? rotation_between(Eigen::Vector3d::UnitZ(), front)
                            : Eigen::Matrix3d::Identity().eval();
}

// Whether trunk and legs are upright: some writers' rest poses have all bones along one axis.
bool stands(const Points& joints, const Humanoid& person) {
  const Eigen::Vector3d hips = middle(joints, person.legs[0].hip, person.legs[1].hip);
  const Eigen::Vector3d shoulders =
      middle(joints, person.arms[0].shoulder, person.arms[1].shoulder);
  bool upright = (shoulders - hips).normalized().y() > kUpright &&
                 direction(joints, person.spine.back(), person.neck.back()).y() > kUpright;
  for (const Leg& leg : person.legs) {
    upright = upright && direction(joints, leg.ankle, leg.hip).y() > kUpright;
  }
  return upright;
}

// The chest, then the neck up to the head.
std::vector<int> chest_to_head(const Humanoid& person) {
  std::vector<int> chain = {person.spine.back()};
  chain.insert(chain.end(), person.neck.begin(), person.neck.end());
  return chain;
}

}  // namespace

Eigen::Matrix3d pelvis_axes(const Points& joints, const Humanoid& person) {
  const Eigen::Vector3d left = direction(joints, person.legs[1].hip, person.legs[0].hip);
  const Eigen::Vector3d hips = middle(joints, person.legs[0].hip, person.legs[1].hip);
  const Eigen::Vector3d shoulders =
      middle(joints, person.arms[0].shoulder, person.arms[1].shoulder);
  return axes(left, shoulders - hips);
}

Eigen::Matrix3d chest_axes(const Points& joints, const Humanoid& person) {
  const Eigen::Vector3d left = direction(joints, person.arms[1].shoulder, person.arms[0].shoulder);
  const Eigen::Vector3d hips = middle(joints, person.legs[0].hip, person.legs[1].hip);
  const Eigen::Vector3d shoulders =
      middle(joints, person.arms[0].shoulder, person.arms[1].shoulder);
  return axes(left, shoulders - hips);
}

std::vector<Follow> correspondence(const Skeleton& source, const Humanoid& source_person,
                                   const Skeleton& target, const Humanoid& target_person) {
  std::vector<Follow> follows(target.names.size());
  const auto pair = [&](int to, int from) {
    if (to >= 0 && from >= 0) {
      follows[static_cast<std::size_t>(to)] = {from, from, 0};
    }
  };
  follow_chain(source, chest_to_head(source_person), target, chest_to_head(target_person), follows);
  follow_chain(source, source_person.spine, target, target_person.spine, follows);
  for (std::size_t side = 0; side < 2; ++side) {
    const Leg& from_leg = source_person.legs[side];
    const Leg& to_leg = target_person.legs[side];
    pair(to_leg.hip, from_leg.hip);
    pair(to_leg.knee, from_leg.knee);
    pair(to_leg.ankle, from_leg.ankle);
    pair(to_leg.toe, from_leg.toe);
    const Arm& from_arm = source_person.arms[side];
    const Arm& to_arm = target_person.arms[side];
    pair(to_arm.collar, from_arm.collar);
    pair(to_arm.shoulder, from_arm.shoulder);
    pair(to_arm.elbow, from_arm.elbow);
    pair(to_arm.wrist, from_arm.wrist);
    for (std::size_t f = 0; f < 5; ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        pair(to_arm.fingers[f][k], from_arm.fingers[f][k]);
      }
    }
  }
  // Joints that mean nothing to us (a jaw, a metacarpal) follow their namesakes.
  for (std::size_t j = 0; j < follows.size(); ++j) {
    if (follows[j].a < 0) {
      pair(static_cast<int>(j), find_joint(source, target.names[j]));
    }
  }
  return follows;
}

int reference_frame(const MotionClip& clip, const Humanoid& source_person, const Skeleton& target,
                    const Humanoid& target_person) {
  const Eigen::Matrix<double, 3, 8> wanted = limb_directions(rest_positions(target), target_person);
  const double rest =
      mean_angle(limb_directions(rest_positions(clip.skeleton), source_person), wanted);
  if (rest < kRestIsFine) {
    return -1;
  }
  double least = rest;
  int best = -1;
  const int frames = static_cast<int>(clip.motion.poses.size());
  const int step = std::max(1, frames / kMaxCandidates);
  for (int frame = 0; frame < frames; frame += step) {
    const double off = mean_angle(
        limb_directions(
            forward_kinematics(clip.skeleton, clip.motion.poses[static_cast<std::size_t>(frame)])
                .positions,
            source_person),
        wanted);
    if (off < least) {
      least = off;
      best = frame;
    }
  }
  return best;
}

AlignmentReference standing_reference(const Skeleton& source, const Pose& pose) {
  const JointFrames frames = forward_kinematics(source, pose);
  return {frames, {frames, frames}, frames};
}

AlignmentReference moving_reference(const MotionClip& clip, const Humanoid& person, int frame) {
  AlignmentReference reference =
      standing_reference(clip.skeleton, clip.motion.poses[static_cast<std::size_t>(frame)]);
  // In the middle of a motion a head may look anywhere.
  const JointFrames rest = forward_kinematics(clip.skeleton, rest_pose(clip.skeleton));
  if (stands(rest.positions, person)) {
    reference.neck = rest;
  }
  for (const Pose& pose : clip.motion.poses) {
    const JointFrames frames = forward_kinematics(clip.skeleton, pose);
    for (std::size_t side = 0; side < 2; ++side) {
      const int ankle = person.legs[side].ankle;
      if (frames.positions(ankle, 1) < reference.feet[side].positions(ankle, 1)) {
        reference.feet[side] = frames;
      }
    }
  }
  return reference;
}

std::vector<Eigen::Matrix3d> aligned_rotations(const AlignmentReference& reference,
                                               const Humanoid& source_person,
                                               const Skeleton& target,
                                               const Humanoid& target_person) {
  const JointFrames rest = forward_kinematics(target, rest_pose(target));
  const Points& from = reference.frames.positions;
  const Points& to = rest.positions;
  const Eigen::Matrix3d pelvis =
      pelvis_axes(from, source_person) * pelvis_axes(to, target_person).transpose();
  const Eigen::Matrix3d chest =
      chest_axes(from, source_person) * chest_axes(to, target_person).transpose();

  // turns[j]: how the joint is turned away from its rest, in the world.
  std::vector<Eigen::Matrix3d> turns(target.names.size());
  std::vector<bool> known(target.names.size(), false);
  const auto set = [&](int joint, const Eigen::Matrix3d& turn) {
    turns[static_cast<std::size_t>(joint)] = turn;
    known[static_cast<std::size_t>(joint)] = true;
  };
  const std::vector<double> places = shares(target, target_person.spine);
  const Eigen::Vector3d pelvis_to_chest = rotation_vector(pelvis.transpose() * chest);
  for (std::size_t i = 0; i < places.size(); ++i) {
    set(target_person.spine[i], pelvis * rotation_matrix(places[i] * pelvis_to_chest));
  }
  const Eigen::Matrix3d neck = chest_axes(reference.neck.positions, source_person) *
                               chest_axes(to, target_person).transpose();
  for (const int joint : target_person.neck) {
    set(joint, neck);
  }
  const auto swing = [&](int joint, int tip, int source_joint, int source_tip,
                         const Eigen::Matrix3d& before) {
    if (joint < 0) {
      return before;
    }
    Eigen::Matrix3d turn = before;
    if (tip >= 0 && source_joint >= 0 && source_tip >= 0 &&
        (from.row(source_tip) - from.row(source_joint)).norm() > 1e-6 &&
        (to.row(tip) - to.row(joint)).norm() > 1e-6) {
      turn = rotation_between(before * direction(to, joint, tip),
                              direction(from, source_joint, source_tip)) *
             before;
    }
    set(joint, turn);
    return turn;
  };
  for (std::size_t side = 0; side < 2; ++side) {
    const Leg& leg = target_person.legs[side];
    const Leg& source_leg = source_person.legs[side];
    const Eigen::Matrix3d thigh = swing(leg.hip, leg.knee, source_leg.hip, source_leg.knee, pelvis);
    swing(leg.knee, leg.ankle, source_leg.knee, source_leg.ankle, thigh);
    // Soles stay level: the foot is turned about the vertical alone, to the heading of the toes.
    Eigen::Matrix3d foot = heading_of(pelvis);
    if (leg.toe >= 0 && source_leg.toe >= 0) {
      const Eigen::Vector3d is = level(direction(to, leg.ankle, leg.toe));
      const Eigen::Vector3d wanted =
          level(direction(reference.feet[side].positions, source_leg.ankle, source_leg.toe));
      if (is.norm() > 0.1 && wanted.norm() > 0.1) {
        foot = rotation_between(is, wanted);
      }
    }
    set(leg.ankle, foot);
    if (leg.toe >= 0) {
      set(leg.toe, foot);
    }

    const Arm& arm = target_person.arms[side];
    const Arm& source_arm = source_person.arms[side];
    if (arm.collar >= 0) {
      set(arm.collar, chest);
    }
    const Eigen::Matrix3d upper =
        swing(arm.shoulder, arm.elbow, source_arm.shoulder, source_arm.elbow, chest);
    const Eigen::Matrix3d lower =
        swing(arm.elbow, arm.wrist, source_arm.elbow, source_arm.wrist, upper);
    // The hand points to the knuckle of its middle finger, if both have one.
    const Eigen::Matrix3d hand =
        swing(arm.wrist, arm.fingers[2][0], source_arm.wrist, source_arm.fingers[2][0], lower);
    for (std::size_t f = 0; f < 5; ++f) {
      Eigen::Matrix3d finger = hand;
      for (std::size_t k = 0; k < 3; ++k) {
        const int tip = k < 2 ? arm.fingers[f][k + 1] : -1;
        const int source_tip = k < 2 ? source_arm.fingers[f][k + 1] : -1;
        finger = swing(arm.fingers[f][k], tip, source_arm.fingers[f][k], source_tip, finger);
      }
    }
  }

  std::vector<Eigen::Matrix3d> aligned(target.names.size());
  for (std::size_t j = 0; j < aligned.size(); ++j) {
    if (!known[j]) {
      const int parent = target.parents[j];
      turns[j] =
          parent < 0 ? Eigen::Matrix3d::Identity().eval() : turns[static_cast<std::size_t>(parent)];
    }
    aligned[j] = turns[j] * rest.rotations[j];
  }
  return aligned;
}

}  // namespace atelier
