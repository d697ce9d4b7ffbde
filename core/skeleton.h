#pragma once

#include <string>
#include <vector>

#include "core/types.h"

namespace atelier {

/// A tree of joints. Parents come before their children; joint 0 is the only root (parent -1).
/// A joint's rest frame has the world's axes unless `rest_rotations` says otherwise.
struct Skeleton {
  std::vector<std::string> names;  ///< [J], unique
  std::vector<int> parents;        ///< [J], parents[j] < j, parents[0] = -1
  Points offsets;         ///< [J,3] metres, from the parent's joint in the parent's rest frame
  Points rest_rotations;  ///< [J,3] rotation vectors, joint's rest frame relative to its
                          ///< parent's; empty: identity
  Points limits_min;      ///< [J,3] radians, rotation-vector components, or empty
  Points limits_max;      ///< [J,3] radians, or empty
};

/// Throws DataError unless sizes agree, names are unique and not empty, there is one root, parents
/// precede children and every number is finite.
void check_skeleton(const Skeleton& skeleton, const std::string& file = "");

/// Index of a joint by name, -1 if there is none.
int find_joint(const Skeleton& skeleton, const std::string& name);

}  // namespace atelier
