#include "bodymodel/retarget/motion_resample.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "bodymodel/rotation.h"
#include "core/error.h"
#include "core/limits.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

namespace atelier {

Pose smooth_pose(const Motion& motion, double seconds) {
  ATELIER_CHECK(!motion.poses.empty() && motion.fps > 0, "a motion with poses and a rate");
  const auto last = static_cast<Index>(motion.poses.size()) - 1;
  const double at = std::clamp(seconds * motion.fps, 0.0, static_cast<double>(last));
  const auto before = saturating_cast<Index>(at);
  const double t = at - static_cast<double>(before);
  const auto pose = [&](Index frame) -> const Pose& {
    return motion.poses[static_cast<std::size_t>(std::clamp<Index>(frame, 0, last))];
  };
  if (t < 1e-9) {
    return pose(before);
  }
  // Beyond an end the motion mirrors itself.
  const auto translation = [&](Index frame) -> Eigen::Vector3d {
    if (frame >= 0 && frame <= last) {
      return pose(frame).root_translation;
    }
    const Index end = std::clamp<Index>(frame, 0, last);
    return 2 * pose(end).root_translation - pose(2 * end - frame).root_translation;
  };
  const auto quaternion = [&](Index frame, Index joint) -> Eigen::Vector4d {
    const auto of = [&](Index f) {
      return quaternion_of(pose(f).rotations.row(joint).transpose());
    };
    if (frame >= 0 && frame <= last) {
      return of(frame);
    }
    const Index end = std::clamp<Index>(frame, 0, last);
    const Eigen::Vector4d at_end = of(end);
    const Eigen::Vector4d inside = of(2 * end - frame);
    return 2 * inside.dot(at_end) * at_end - inside;
  };
  const std::array<double, 4> weights = {0.5 * t * (-1 + t * (2 - t)),
                                         1 + 0.5 * t * t * (3 * t - 5),
                                         0.5 * t * (1 + t * (4 - 3 * t)), 0.5 * t * t * (t - 1)};
  Pose result = pose(before);
  result.root_translation.setZero();
  for (int k = 0; k < 4; ++k) {
    result.root_translation += weights[static_cast<std::size_t>(k)] * translation(before - 1 + k);
  }
  for (Index j = 0; j < result.rotations.rows(); ++j) {
    const Eigen::Vector4d near = quaternion(before, j);
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector4d q = quaternion(before - 1 + k, j);
      sum += (q.dot(near) < 0 ? -1 : 1) * weights[static_cast<std::size_t>(k)] * q;
    }
    result.rotations.row(j) =
        nearest_equivalent(rotation_vector(matrix_of_quaternion(sum.normalized())),
                           pose(before).rotations.row(j).transpose())
            .transpose();
  }
  return result;
}

Motion resampled(const Motion& motion, double fps) {
  ATELIER_CHECK(fps > 0 && motion.fps > 0, "frame rates are positive");
  if (fps == motion.fps || motion.poses.size() < 2) {
    Motion same = motion;
    same.fps = fps;
    return same;
  }
  Motion result;
  result.fps = fps;
  const double duration = static_cast<double>(motion.poses.size() - 1) / motion.fps;
  const int frames = saturating_cast<int>(std::floor(duration * fps + 1e-9) + 1);
  if (frames > Limits{}.frames) {
    throw DataError("", "motion",
                    short_number(duration) + " s, which are " + std::to_string(frames) +
                        " frames at " + short_number(fps) + " a second",
                    "at most " + std::to_string(Limits{}.frames));
  }
  for (int frame = 0; frame < frames; ++frame) {
    const double at = frame / fps * motion.fps;
    const std::size_t before =
        std::min(saturating_cast<std::size_t>(at + 1e-9), motion.poses.size() - 2);
    const double share = std::clamp(at - static_cast<double>(before), 0.0, 1.0);
    result.poses.push_back(
        share < 1e-9 ? motion.poses[before]
                     : interpolated_pose(motion.poses[before], motion.poses[before + 1], share));
    result.frame_ids.push_back(frame);
  }
  return result;
}

}  // namespace atelier
