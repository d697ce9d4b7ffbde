#include "bodymodel/formats/path_joint.h"

#include <algorithm>
#include <optional>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"

namespace atelier {
namespace {

constexpr double kNoGap = 1e-9;  // of the skeleton's unit: nothing to carry

}  // namespace

int path_joint(const Skeleton& skeleton) {
  const std::optional<Humanoid> person = find_humanoid(skeleton);
  if (!person) {
    return 0;
  }
  int joint = person->legs[0].hip;
  while (joint > 0 && !is_on_path(skeleton, joint, person->legs[1].hip)) {
    joint = skeleton.parents[static_cast<std::size_t>(joint)];
  }
  return std::max(joint, 0);
}

bool is_on_path(const Skeleton& skeleton, int joint, int below) {
  while (below > joint) {
    below = skeleton.parents[static_cast<std::size_t>(below)];
  }
  return below == joint;
}

void carry_by_root(const Skeleton& skeleton, int joint, const Eigen::Vector3d& place, Pose& pose) {
  const Eigen::Vector3d gap =
      place - forward_kinematics(skeleton, pose).positions.row(joint).transpose();
  if (gap.cwiseAbs().maxCoeff() > kNoGap) {
    pose.root_translation += gap;
  }
}

}  // namespace atelier
