#include <array>
#include <cmath>
#include <numbers>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "capture/keypoint_schema.h"
#include "core/error.h"
#include "core/tree.h"
#include "pipeline/synthesis/synthetic_subject.h"

namespace atelier {
namespace {

/// The joint that moves each vertex most.
std::vector<int> dominant_joints(const BodyModel& model) {
  std::vector<int> result(static_cast<std::size_t>(vertex_count(model)));
  for (Index v = 0; v < vertex_count(model); ++v) {
    Index slot = 0;
    model.skin.weights.row(v).maxCoeff(&slot);
    result[static_cast<std::size_t>(v)] = model.skin.joints(v, slot);
  }
  return result;
}

bool hangs_on(const Skeleton& skeleton, int joint, int ancestor) {
  for (; joint >= 0; joint = skeleton.parents[static_cast<std::size_t>(joint)]) {
    if (joint == ancestor) {
      return true;
    }
  }
  return false;
}

/// The vertex that goes furthest along a direction, among those that a joint (and what hangs on it)
/// moves most; the joint itself if there is none.
Eigen::Vector3d extreme(const BodyModel& model, const std::vector<int>& dominant, int joint,
                        const Eigen::Vector3d& direction) {
  Eigen::Vector3d best = rest_positions(model.skeleton).row(joint).transpose();
  double most = -std::numeric_limits<double>::infinity();
  for (Index v = 0; v < vertex_count(model); ++v) {
    if (!hangs_on(model.skeleton, dominant[static_cast<std::size_t>(v)], joint)) {
      continue;
    }
    const double along = model.mesh.vertices.row(v).dot(direction);
    if (along > most) {
      most = along;
      best = model.mesh.vertices.row(v).transpose();
    }
  }
  return best;
}

/// The 68 points of iBUG 300-W on a face seen from the front: x to the person's left, y up, in
/// half-distances of the eyes, eyes at (+-1, 0).
std::vector<Eigen::Vector2d> face_template() {
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 17; ++i) {  // jaw, from the person's right ear to the left one
    const double a = std::numbers::pi * (i - 8) / 16.0;
    points.emplace_back(2.15 * std::sin(a), 0.1 - 3.35 * std::cos(a) * (0.75 + 0.25 * std::cos(a)));
  }
  for (int side : {-1, 1}) {  // brows
    for (int i = 0; i < 5; ++i) {
      const double x = side < 0 ? 1.75 - 0.35 * i : 0.35 + 0.35 * i;
      points.emplace_back(side * x, 0.62 + 0.12 * std::sin(std::numbers::pi * i / 4.0));
    }
  }
  for (int i = 0; i < 4; ++i) {  // bridge
    points.emplace_back(0, 0.1 - 0.42 * i);
  }
  for (int i = -2; i <= 2; ++i) {
    points.emplace_back(0.25 * i, -1.42 - 0.06 * (2 - std::abs(i)));
  }
  for (int side : {-1, 1}) {  // eyes: outer corner first on the right, inner first on the left
    const std::array<std::array<double, 2>, 6> eye = {
        {{-0.45, 0}, {-0.15, 0.16}, {0.15, 0.16}, {0.45, 0}, {0.15, -0.14}, {-0.15, -0.14}}};
    for (const auto& p : eye) {
      points.emplace_back(side + p[0], p[1]);
    }
  }
  const auto lips = [&](double half_width, double top, double bottom, int upper, int lower) {
    for (int i = 0; i < upper; ++i) {
      const double t = static_cast<double>(i) / (upper - 1);
      points.emplace_back(half_width * (2 * t - 1), -2.05 + top * std::sin(std::numbers::pi * t));
    }
    for (int i = 1; i <= lower; ++i) {
      const double t = static_cast<double>(i) / (lower + 1);
      points.emplace_back(half_width * (1 - 2 * t),
                          -2.05 - bottom * std::sin(std::numbers::pi * t));
    }
  };
  lips(0.8, 0.22, 0.36, 7, 5);
  lips(0.6, 0.06, 0.08, 5, 3);
  return points;
}

}  // namespace

SubjectKeypoints subject_keypoints(const BodyModel& model) {
  const Skeleton& skeleton = model.skeleton;
  const Humanoid person = recognised_humanoid(skeleton);
  const Points joints = rest_positions(skeleton);
  const std::vector<int> dominant = dominant_joints(model);
  const auto at = [&](int joint) -> Eigen::Vector3d { return joints.row(joint).transpose(); };
  const int head = person.neck.back();
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d front = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d left = Eigen::Vector3d::UnitX();

  // Eyes: their joints where the skeleton has them, else where Drillis and Contini have them.
  const Eigen::Vector3d top = extreme(model, dominant, head, up);
  const double height = top.y() - model.mesh.vertices.col(1).minCoeff();
  std::array<Eigen::Vector3d, 2> eyes;
  const std::array<const char*, 2> eye_names = {"left_eye", "right_eye"};
  for (std::size_t side = 0; side < 2; ++side) {
    const int joint = find_joint(skeleton, eye_names[side]);
    eyes[side] = joint >= 0 ? at(joint)
                            : Eigen::Vector3d(at(head).x() + (side == 0 ? 0.018 : -0.018) * height,
                                              top.y() - 0.064 * height, at(head).z());
  }
  const TriangleTree tree = build_tree(model.mesh.vertices, model.mesh.faces);
  const auto on_face = [&](double x, double y) {
    const Eigen::Vector3d middle = (eyes[0] + eyes[1]) / 2;
    const double unit = (eyes[0].x() - eyes[1].x()) / 2;
    const Eigen::Vector3d from(middle.x() + unit * x, middle.y() + unit * y, middle.z() + 1);
    const RayHit hit = first_hit(tree, {from, -front, 0, 2});
    return hit.face >= 0 ? Eigen::Vector3d(from - hit.t * front)
                         : Eigen::Vector3d(from.x(), from.y(), at(head).z());
  };

  SubjectKeypoints result;
  const auto add = [&](const std::string& name, int joint, const Eigen::Vector3d& rest) {
    result.names.push_back(name);
    result.places.push_back({joint, rest});
  };
  const std::vector<Eigen::Vector2d> face = face_template();
  for (const std::string& name : coco_wholebody_schema().points) {
    const int side = name.starts_with("right_") ? 1 : 0;
    const auto s = static_cast<std::size_t>(side);
    const Eigen::Vector3d outward = side == 0 ? left : Eigen::Vector3d(-left);
    const Leg& leg = person.legs[s];
    const Arm& arm = person.arms[s];
    const std::string part = name.substr(name.find('_') + 1);
    const int foot = leg.toe >= 0 ? leg.toe : leg.ankle;
    if (name == "nose") {
      add(name, head, on_face(0, -1.2));
    } else if (name.starts_with("face_")) {
      const Eigen::Vector2d& p = face[static_cast<std::size_t>(std::stoi(part))];
      add(name, head, on_face(p.x(), p.y()));
    } else if (part == "eye") {
      add(name, head, on_face(side == 0 ? 1 : -1, 0));
    } else if (part == "ear") {
      add(name, head, extreme(model, dominant, head, outward));
    } else if (part == "shoulder") {
      add(name, arm.shoulder, at(arm.shoulder));
    } else if (part == "elbow") {
      add(name, arm.elbow, at(arm.elbow));
    } else if (part == "wrist" || part == "hand_root") {
      add(name, arm.wrist, at(arm.wrist));
    } else if (part == "hip") {
      add(name, leg.hip, at(leg.hip));
    } else if (part == "knee") {
      add(name, leg.knee, at(leg.knee));
    } else if (part == "ankle") {
      add(name, leg.ankle, at(leg.ankle));
    } else if (part == "big_toe") {
      add(name, foot, extreme(model, dominant, leg.ankle, front - 0.35 * outward));
    } else if (part == "small_toe") {
      add(name, foot, extreme(model, dominant, leg.ankle, front + 0.9 * outward));
    } else if (part == "heel") {
      add(name, leg.ankle, extreme(model, dominant, leg.ankle, -front - 0.3 * up));
    } else {
      const std::array<std::string, 5> fingers = {"thumb", "index", "middle", "ring", "little"};
      for (std::size_t f = 0; f < fingers.size(); ++f) {
        if (!part.starts_with(fingers[f])) {
          continue;
        }
        const int phalanx = part.back() - '1';
        const std::array<int, 3>& chain = arm.fingers[f];
        int joint = arm.wrist;
        for (int k = 0; k <= std::min(phalanx, 2); ++k) {
          joint =
              chain[static_cast<std::size_t>(k)] >= 0 ? chain[static_cast<std::size_t>(k)] : joint;
        }
        const Eigen::Vector3d along = at(joint) - at(arm.wrist);
        add(name, joint,
            phalanx == 3 && along.norm() > 0 ? extreme(model, dominant, joint, along) : at(joint));
      }
    }
  }
  ATELIER_CHECK(result.names.size() == coco_wholebody_schema().points.size(),
                "a keypoint without a place");
  const int chest = person.spine.back();
  add("neck", chest, (at(person.arms[0].shoulder) + at(person.arms[1].shoulder)) / 2);
  add("mid_hip", person.spine.front(), (at(person.legs[0].hip) + at(person.legs[1].hip)) / 2);
  return result;
}

}  // namespace atelier
