#include "bodymodel/bone_lengths.h"

#include <algorithm>
#include <utility>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr double kSizeSpread = 0.1;  // of people about a model without shapes

/// True for `joint` and all that hangs on it.
std::vector<char> hanging_on(const Skeleton& skeleton, int joint) {
  std::vector<char> hangs(skeleton.parents.size(), 0);
  for (std::size_t j = 0; j < hangs.size(); ++j) {
    const int parent = skeleton.parents[j];
    hangs[j] = static_cast<int>(j) == joint ||
               (parent >= 0 && hangs[static_cast<std::size_t>(parent)] != 0);
  }
  return hangs;
}

/// Adds to a parameter what one metre more between two joints moves: the bone from `from` down to
/// `to`, over as many joints as there are between them.
void lengthen(const BodyModel& model, const Points& rest, int from, int to,
              ShapeParameter& parameter) {
  const Skeleton& skeleton = model.skeleton;
  const Eigen::RowVector3d bone = rest.row(to) - rest.row(from);
  const double length = bone.norm();
  if (!(length > 1e-6)) {
    return;
  }
  const Eigen::RowVector3d along = bone / length;
  const auto share = [&](const Eigen::RowVector3d& point) {
    return std::clamp((point - rest.row(from)).dot(along) / length, 0.0, 1.0);
  };
  std::vector<char> is_bone(skeleton.parents.size(), 0);  // joints whose skin stretches
  for (int j = skeleton.parents[static_cast<std::size_t>(to)]; j >= 0;
       j = skeleton.parents[static_cast<std::size_t>(j)]) {
    is_bone[static_cast<std::size_t>(j)] = 1;
    if (j == from) {
      break;
    }
  }
  const std::vector<char> moves = hanging_on(skeleton, from);
  const std::vector<char> beyond = hanging_on(skeleton, to);
  std::vector<double> shift(skeleton.parents.size(), 0);  // of joints, and of skin off the bone
  for (std::size_t j = 0; j < shift.size(); ++j) {
    const auto parent = static_cast<std::size_t>(std::max(0, skeleton.parents[j]));
    if (beyond[j] != 0) {
      shift[j] = 1;
    } else if (moves[j] != 0 && static_cast<int>(j) != from) {
      // Where it hangs on the bone tells how far it goes along; what hangs on it goes as far.
      shift[j] = is_bone[j] != 0 || is_bone[parent] != 0 ? share(rest.row(static_cast<Index>(j)))
                                                         : shift[parent];
    }
    parameter.joints.row(static_cast<Index>(j)) += shift[j] * along;
  }
  for (Index v = 0; v < vertex_count(model); ++v) {
    double moved = 0;
    for (Index k = 0; k < model.skin.weights.cols(); ++k) {
      const auto joint = static_cast<std::size_t>(model.skin.joints(v, k));
      moved += model.skin.weights(v, k) *
               (is_bone[joint] != 0 ? share(model.mesh.vertices.row(v)) : shift[joint]);
    }
    parameter.surface.offsets.row(v) += moved * along;
  }
}

}  // namespace

BodyModel with_bone_lengths(const BodyModel& model, double spread) {
  ATELIER_CHECK(spread > 0, "bones differ by something");
  const Humanoid who = recognised_humanoid(model.skeleton);
  const Points rest = rest_positions(model.skeleton);
  BodyModel result = model;
  const auto parameter = [&](const std::string& name, const char* unit, double range) {
    return ShapeParameter{find_shape(model, name) < 0 ? name : "bone_" + name,
                          unit,
                          0,
                          -range,
                          range,
                          {{}, Points::Zero(vertex_count(model), 3)},
                          Points::Zero(joint_count(model), 3)};
  };
  if (model.shape.empty()) {
    ShapeParameter size = parameter("size", "", kSizeSpread);
    size.surface.offsets = model.mesh.vertices;
    size.joints = rest;
    result.shape.push_back(std::move(size));
  }
  // Who stands on the ground still does with other legs, as with other shapes.
  const auto stand = [&](ShapeParameter& length) {
    Eigen::RowVector3d sunk = Eigen::RowVector3d::Zero();
    for (const Leg& leg : who.legs) {
      sunk.y() += 0.5 * length.joints(leg.ankle, 1);
    }
    length.joints.rowwise() -= sunk;
    length.surface.offsets.rowwise() -= sunk;
  };
  using Bones = std::vector<std::pair<int, int>>;
  const auto add = [&](const char* name, const Bones& bones) {
    ShapeParameter length = parameter(name, "m", 0);
    for (const auto& [from, to] : bones) {
      if (from >= 0 && to >= 0 && from != to) {
        lengthen(model, rest, from, to, length);
        length.max = std::max(length.max, spread * (rest.row(to) - rest.row(from)).norm());
      }
    }
    length.min = -length.max;
    if (length.max > 0) {
      stand(length);
      result.shape.push_back(std::move(length));
    }
  };
  const auto& [left, right] = std::pair(who.legs[0], who.legs[1]);
  const auto& [arm, other] = std::pair(who.arms[0], who.arms[1]);
  add("thigh_length", {{left.hip, left.knee}, {right.hip, right.knee}});
  add("shin_length", {{left.knee, left.ankle}, {right.knee, right.ankle}});
  add("foot_length", {{left.ankle, left.toe}, {right.ankle, right.toe}});
  add("upper_arm_length", {{arm.shoulder, arm.elbow}, {other.shoulder, other.elbow}});
  add("forearm_length", {{arm.elbow, arm.wrist}, {other.elbow, other.wrist}});
  add("shoulder_breadth_half", {{arm.collar, arm.shoulder}, {other.collar, other.shoulder}});
  add("hip_breadth_half", {{who.spine.front(), left.hip}, {who.spine.front(), right.hip}});
  add("trunk_length", {{who.spine.front(), who.neck.front()}});
  add("neck_length", {{who.neck.front(), who.neck.back()}});
  return result;
}

}  // namespace atelier
