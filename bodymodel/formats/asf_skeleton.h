#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/limits.h"
#include "core/types.h"

namespace atelier {

/// One bone of an ASF file, in the file's units.
struct AsfBone {
  std::string name;
  int parent = -1;                                      ///< -1: the root
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit, world axes
  double length = 0;
  Eigen::Matrix3d axis = Eigen::Matrix3d::Identity();  ///< C, the bone's axes in the world
  std::string order = "XYZ";                           ///< of its degrees of freedom
  std::vector<char> dofs;  ///< in the order of the AMC's values: 'X' 'Y' 'Z' rotations; of the root
                           ///< also 'x' 'y' 'z' translations
};

/// Content of an ASF file: the root is bone 0; parents come before children.
struct AsfSkeleton {
  std::vector<AsfBone> bones;
  double radians_per_unit = 0;  ///< of angles in the ASF
};

/// Reads an ASF file; throws as read_amc says.
AsfSkeleton read_asf(std::span<const std::byte> bytes, const std::string& name,
                     const Limits& limits = {});

}  // namespace atelier
