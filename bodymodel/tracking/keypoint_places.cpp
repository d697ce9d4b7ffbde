#include "bodymodel/tracking/keypoint_places.h"

#include <array>
#include <limits>
#include <optional>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr double kJointSpread = 0.004;    // m: what detectors call a joint is not quite the joint
constexpr double kSurfaceSpread = 0.012;  // m: toes, heels, ears
constexpr double kEyesBelowTop = 0.064;   // of stature (Drillis and Contini 1966)
constexpr double kEyeBesideMiddle = 0.018;

struct Place {
  int joint = -1;
  Eigen::Vector3d rest;  // world axes, where it is in the rest pose
  double spread = kJointSpread;
};

/// Surface and axes from which the places of one body are read.
class Anatomy {
 public:
  explicit Anatomy(const BodyModel& model)
      : model_(model),
        person_(recognised_humanoid(model.skeleton)),
        joints_(rest_positions(model.skeleton)),
        tree_(build_tree(model.mesh.vertices, model.mesh.faces)),
        dominant_(static_cast<std::size_t>(vertex_count(model))) {
    for (Index v = 0; v < vertex_count(model); ++v) {
      Index slot = 0;
      model.skin.weights.row(v).maxCoeff(&slot);
      dominant_[static_cast<std::size_t>(v)] = model.skin.joints(v, slot);
    }
    const Eigen::Vector3d top = furthest(head(), Eigen::Vector3d::UnitY());
    const double stature = top.y() - model.mesh.vertices.col(1).minCoeff();
    const std::array<const char*, 2> names = {"left_eye", "right_eye"};
    for (std::size_t side = 0; side < 2; ++side) {
      const int joint = find_joint(model.skeleton, names[side]);
      const double beside = (side == 0 ? kEyeBesideMiddle : -kEyeBesideMiddle) * stature;
      eyes_[side] = joint >= 0 ? at(joint)
                               : Eigen::Vector3d(at(head()).x() + beside,
                                                 top.y() - kEyesBelowTop * stature, at(head()).z());
    }
  }

  std::optional<Place> place(const std::string& name) const {
    if (name == "nose") {
      return Place{head(), on_face(0, -1.2), kSurfaceSpread};
    }
    if (name == "neck" || name == "upper_neck") {
      const Eigen::Vector3d middle =
          (at(person_.arms[0].shoulder) + at(person_.arms[1].shoulder)) / 2;
      return name == "neck" ? Place{person_.spine.back(), middle}
                            : Place{person_.neck.front(), at(person_.neck.front()), kSurfaceSpread};
    }
    if (name == "mid_hip") {
      return Place{person_.spine.front(), (at(person_.legs[0].hip) + at(person_.legs[1].hip)) / 2};
    }
    if (name == "head_top") {
      return Place{head(), furthest(head(), Eigen::Vector3d::UnitY()), kSurfaceSpread};
    }
    if (name.starts_with("left_")) {
      return of_side(0, name.substr(5));
    }
    if (name.starts_with("right_")) {
      return of_side(1, name.substr(6));
    }
    return std::nullopt;
  }

 private:
  int head() const { return person_.neck.back(); }
  Eigen::Vector3d at(int joint) const { return joints_.row(joint).transpose(); }

  /// The vertex that goes furthest along a direction, of those that the joint, or what hangs on it,
  /// moves most.
  Eigen::Vector3d furthest(int joint, const Eigen::Vector3d& direction) const {
    std::vector<char> hangs(model_.skeleton.names.size(), 0);
    for (std::size_t j = 0; j < hangs.size(); ++j) {
      const int parent = model_.skeleton.parents[j];
      hangs[j] = static_cast<int>(j) == joint ||
                 (parent >= 0 && hangs[static_cast<std::size_t>(parent)] != 0);
    }
    Eigen::Vector3d best = at(joint);
    double most = -std::numeric_limits<double>::infinity();
    for (Index v = 0; v < vertex_count(model_); ++v) {
      const int carrier = dominant_[static_cast<std::size_t>(v)];
      if (hangs[static_cast<std::size_t>(carrier)] != 0) {
        const double along = model_.mesh.vertices.row(v).dot(direction);
        if (along > most) {
          most = along;
          best = model_.mesh.vertices.row(v).transpose();
        }
      }
    }
    return best;
  }

  /// The point where a ray from the front meets it; x to the left and y up, in half distances of
  /// the eyes from the point between them.
  Eigen::Vector3d on_face(double x, double y) const {
    const Eigen::Vector3d middle = (eyes_[0] + eyes_[1]) / 2;
    const double unit = (eyes_[0].x() - eyes_[1].x()) / 2;
    const Eigen::Vector3d from(middle.x() + unit * x, middle.y() + unit * y, middle.z() + 1);
    const RayHit hit = first_hit(tree_, {from, -Eigen::Vector3d::UnitZ(), 0, 2});
    return hit.face >= 0 ? Eigen::Vector3d(from - hit.t * Eigen::Vector3d::UnitZ())
                         : Eigen::Vector3d(from.x(), from.y(), at(head()).z());
  }

  std::optional<Place> of_side(std::size_t side, const std::string& part) const {
    const Eigen::Vector3d outward = Eigen::Vector3d::UnitX() * (side == 0 ? 1 : -1);
    const Eigen::Vector3d front = Eigen::Vector3d::UnitZ();
    const Leg& leg = person_.legs[side];
    const Arm& arm = person_.arms[side];
    const std::pair<const char*, int> joints[] = {
        {"shoulder", arm.shoulder}, {"elbow", arm.elbow}, {"wrist", arm.wrist},
        {"hand_root", arm.wrist},   {"hip", leg.hip},     {"knee", leg.knee},
        {"ankle", leg.ankle}};
    for (const auto& [name, joint] : joints) {
      if (part == name) {
        return Place{joint, at(joint)};
      }
    }
    const int foot = leg.toe >= 0 ? leg.toe : leg.ankle;
    if (part == "eye") {
      return Place{head(), on_face(side == 0 ? 1 : -1, 0), kSurfaceSpread};
    }
    const double sign = side == 0 ? 1 : -1;
    if (part == "eye_inner" || part == "eye_outer") {
      return Place{head(), on_face(sign * (part == "eye_inner" ? 0.5 : 1.45), 0), kSurfaceSpread};
    }
    if (part == "mouth_corner") {
      return Place{head(), on_face(sign * 0.8, -2.2), kSurfaceSpread};
    }
    if (part == "ear") {
      return Place{head(), furthest(head(), outward), kSurfaceSpread};
    }
    if (part == "big_toe") {
      return Place{foot, furthest(leg.ankle, front - 0.35 * outward), kSurfaceSpread};
    }
    if (part == "small_toe") {
      return Place{foot, furthest(leg.ankle, front + 0.9 * outward), kSurfaceSpread};
    }
    if (part == "foot_index") {
      return Place{foot, furthest(leg.ankle, front), kSurfaceSpread};
    }
    if (part == "heel") {
      return Place{leg.ankle, furthest(leg.ankle, -front - 0.3 * Eigen::Vector3d::UnitY()),
                   kSurfaceSpread};
    }
    return of_finger(arm, part);
  }

  std::optional<Place> of_finger(const Arm& arm, const std::string& part) const {
    const std::array<const char*, 5> fingers = {"thumb", "index", "middle", "ring", "little"};
    for (std::size_t f = 0; f < fingers.size(); ++f) {
      const std::string stem = std::string(fingers[f]) + "_";
      if (!part.starts_with(stem) || part.size() != stem.size() + 1) {
        continue;
      }
      const int phalanx = part.back() - '1';
      if (phalanx < 0 || phalanx > 3) {
        return std::nullopt;
      }
      const std::array<int, 3>& chain = arm.fingers[f];
      int joint = arm.wrist;
      for (int k = 0; k <= std::min(phalanx, 2); ++k) {
        const int next = chain[static_cast<std::size_t>(k)];
        joint = next >= 0 ? next : joint;
      }
      const Eigen::Vector3d along = at(joint) - at(arm.wrist);
      return Place{joint, phalanx == 3 && along.norm() > 0 ? furthest(joint, along) : at(joint)};
    }
    return std::nullopt;
  }

  const BodyModel& model_;
  Humanoid person_;
  Points joints_;
  TriangleTree tree_;
  std::vector<int> dominant_;
  std::array<Eigen::Vector3d, 2> eyes_;
};

}  // namespace

KeypointPlaces keypoint_places(const BodyModel& model, const std::vector<std::string>& names) {
  const Anatomy anatomy(model);
  const JointFrames rest = forward_kinematics(model.skeleton, rest_pose(model.skeleton));
  const auto count = static_cast<Index>(names.size());
  KeypointPlaces places;
  places.names = names;
  places.riding.joints.assign(names.size(), -1);
  places.riding.offsets = Points::Zero(count, 3);
  places.spread = Eigen::VectorXd::Zero(count);
  for (Index k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (const std::optional<Place> place = anatomy.place(names[i])) {
      const auto joint = static_cast<std::size_t>(place->joint);
      places.riding.joints[i] = place->joint;
      places.riding.offsets.row(k) = (rest.rotations[joint].transpose() *
                                      (place->rest - rest.positions.row(place->joint).transpose()))
                                         .transpose();
      places.spread[k] = place->spread;
    }
  }
  return places;
}

}  // namespace atelier
