#include "core/skeleton.h"

#include <algorithm>
#include <unordered_map>

#include "core/error.h"

namespace atelier {
namespace {

void check_rows(const Points& rows, Index joints, bool may_be_empty, const char* what,
                const std::string& file) {
  if (rows.rows() == 0 && may_be_empty) {
    return;
  }
  if (rows.rows() != joints) {
    throw DataError(file, what, std::to_string(rows.rows()) + " rows",
                    std::to_string(joints) + ", one for each joint");
  }
  if (!rows.allFinite()) {
    throw DataError(file, what, "a number that is not finite", "finite numbers");
  }
}

}  // namespace

void check_skeleton(const Skeleton& skeleton, const std::string& file) {
  const Index joints = static_cast<Index>(skeleton.names.size());
  if (joints == 0) {
    throw DataError(file, "skeleton", "no joints", "at least one");
  }
  if (skeleton.parents.size() != skeleton.names.size()) {
    throw DataError(file, "skeleton", std::to_string(skeleton.parents.size()) + " parents",
                    std::to_string(joints) + ", one for each joint");
  }
  std::unordered_map<std::string, Index> seen;
  for (Index joint = 0; joint < joints; ++joint) {
    const std::string& name = skeleton.names[static_cast<std::size_t>(joint)];
    const std::string place = "joint " + std::to_string(joint) + " '" + name + "'";
    if (name.empty()) {
      throw DataError(file, place, "an empty name", "a unique name");
    }
    if (!seen.emplace(name, joint).second) {
      throw DataError(file, place, "the name of joint " + std::to_string(seen[name]),
                      "a unique name");
    }
    const int parent = skeleton.parents[static_cast<std::size_t>(joint)];
    if (joint == 0 && parent != -1) {
      throw DataError(file, place, "parent " + std::to_string(parent), "-1: joint 0 is the root");
    }
    if (joint > 0 && parent == -1) {
      throw DataError(file, place, "a second root", "one root, joint 0");
    }
    if (joint > 0 && (parent < 0 || parent >= joint)) {
      throw DataError(file, place, "parent " + std::to_string(parent),
                      "a parent before its child (no cycles)");
    }
  }
  check_rows(skeleton.offsets, joints, false, "offsets", file);
  check_rows(skeleton.rest_rotations, joints, true, "rest rotations", file);
  check_rows(skeleton.limits_min, joints, true, "lower limits", file);
  check_rows(skeleton.limits_max, joints, true, "upper limits", file);
}

int find_joint(const Skeleton& skeleton, const std::string& name) {
  const auto found = std::find(skeleton.names.begin(), skeleton.names.end(), name);
  return found == skeleton.names.end() ? -1 : static_cast<int>(found - skeleton.names.begin());
}

}  // namespace atelier
