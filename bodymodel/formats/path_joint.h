#pragma once

#include "core/pose.h"
#include "core/skeleton.h"

namespace atelier {

/// The joint that takes a person through the world: the lowest one that both legs hang on. Files
/// have still joints above it ("Reference", "Armature"), and say in its own positions where the
/// person goes. 0, the root, where there is no person.
int path_joint(const Skeleton& skeleton);

/// Whether `joint` is `below` or above it.
bool is_on_path(const Skeleton& skeleton, int joint, int below);

/// Shifts the root so that `joint` stands at `place` (unit of the skeleton); all that hangs on the
/// joint is then as in a file whose joints move in their parents. O(J).
void carry_by_root(const Skeleton& skeleton, int joint, const Eigen::Vector3d& place, Pose& pose);

}  // namespace atelier
