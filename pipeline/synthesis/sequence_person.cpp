#include "pipeline/synthesis/sequence_person.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "capture/keypoint_schema.h"
#include "core/tree.h"
#include "pipeline/synthesis/synthetic_subject.h"

namespace atelier {
namespace {

constexpr int kFingers = 5;

/// How far down a limb the joint of a role is, with what it hangs on; -1: of no limb.
struct LimbPlace {
  int limb = -1;  ///< 0 leg, 1 arm, 2 and on: fingers
  int rank = 0;
};

LimbPlace limb_place(const std::string& role) {
  const std::array<std::vector<const char*>, 2> limbs = {
      {{"hip", "upper_leg", "leg", "lower_leg", "ankle", "foot", "toe"},
       {"collar", "shoulder", "upper_arm", "lower_arm", "wrist", "hand"}}};
  for (std::size_t limb = 0; limb < limbs.size(); ++limb) {
    for (std::size_t rank = 0; rank < limbs[limb].size(); ++rank) {
      if (role == limbs[limb][rank]) {
        return {static_cast<int>(limb), static_cast<int>(rank)};
      }
    }
  }
  const std::array<const char*, kFingers> fingers = {"thumb", "index", "middle", "ring", "little"};
  for (std::size_t finger = 0; finger < fingers.size(); ++finger) {
    if (role.starts_with(fingers[finger])) {
      return {2 + static_cast<int>(finger), role.back() - '0'};
    }
  }
  return {};
}

/// Parents of joints that a file names without saying what hangs on what: along the limbs, from a
/// joint named as the pelvis. Joints without a role hang on the pelvis. Empty: there is no pelvis.
std::vector<int> parents_by_names(const std::vector<std::string>& names) {
  std::vector<NamedRole> roles;
  int root = -1;
  for (std::size_t j = 0; j < names.size(); ++j) {
    std::string plain = names[j];
    std::transform(plain.begin(), plain.end(), plain.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    plain = plain.substr(plain.rfind(':') == std::string::npos ? 0 : plain.rfind(':') + 1);
    const bool pelvis = plain == "pelvis" || plain == "hips" || plain == "root" ||
                        plain == "mid_hip" || plain == "midhip";
    root = pelvis && root < 0 ? static_cast<int>(j) : root;
    roles.push_back(role_of_name(names[j]));
  }
  if (root < 0) {
    return {};
  }
  std::vector<int> parents(names.size(), root);
  parents[static_cast<std::size_t>(root)] = -1;
  for (std::size_t j = 0; j < names.size(); ++j) {
    const LimbPlace own = limb_place(roles[j].role);
    int best = std::numeric_limits<int>::min();
    for (std::size_t other = 0; own.limb >= 0 && other < names.size(); ++other) {
      const LimbPlace place = limb_place(roles[other].role);
      // A finger's first knuckle hangs on the last joint of the arm.
      const int rank = own.limb > 1 && place.limb == 1 ? place.rank - kFingers - 1
                       : place.limb == own.limb        ? place.rank
                                                       : own.rank;
      if (roles[other].side == roles[j].side && place.limb >= 0 && rank < own.rank && rank > best) {
        best = rank;
        parents[j] = static_cast<int>(other);
      }
    }
  }
  return parents;
}

/// Rows of the file's joints, parents first: of the tree that has most of them.
std::vector<int> tree_rows(const std::vector<int>& parents) {
  std::vector<int> best;
  for (std::size_t root = 0; root < parents.size(); ++root) {
    if (parents[root] >= 0 && parents[root] < static_cast<int>(parents.size())) {
      continue;
    }
    std::vector<int> rows = {static_cast<int>(root)};
    for (std::size_t at = 0; at < rows.size(); ++at) {
      for (std::size_t child = 0; child < parents.size(); ++child) {
        if (parents[child] == rows[at]) {
          rows.push_back(static_cast<int>(child));
        }
      }
    }
    if (rows.size() > best.size()) {
      best = std::move(rows);
    }
  }
  return best;
}

/// The file's joints as a skeleton at a rest place, and their rows in the file.
std::pair<Skeleton, std::vector<int>> file_skeleton(const MeshSequenceFile& body,
                                                    const Points& rest) {
  const std::vector<int> parents =
      body.parents.empty() ? parents_by_names(body.names) : body.parents;
  const std::vector<int> rows = tree_rows(parents);
  std::map<int, int> place;
  Skeleton skeleton;
  skeleton.offsets.resize(static_cast<Index>(rows.size()), 3);
  std::set<std::string> taken;
  for (std::size_t j = 0; j < rows.size(); ++j) {
    const auto row = static_cast<std::size_t>(rows[j]);
    std::string name = body.names[row].empty() ? "joint" : body.names[row];
    for (int copy = 2; !taken.insert(name).second; ++copy) {
      name = body.names[row] + "_" + std::to_string(copy);
    }
    skeleton.names.push_back(name);
    const int parent = j == 0 ? -1 : place.at(parents[row]);
    skeleton.parents.push_back(parent);
    skeleton.offsets.row(static_cast<Index>(j)) = rest.row(rows[j]);
    if (parent >= 0) {
      skeleton.offsets.row(static_cast<Index>(j)) -=
          rest.row(rows[static_cast<std::size_t>(parent)]);
    }
    place[rows[j]] = static_cast<int>(j);
  }
  return {skeleton, rows};
}

/// The horizontal direction in which a person looks: to the left joints' right. Where sides are by
/// topology, which takes +X for left, the feet say which is which: they are in front of the ankles.
Eigen::Vector3d front_of(const Skeleton& skeleton, const Humanoid& who, const Points& joints,
                         const Points& vertices) {
  Eigen::RowVector3d left = Eigen::RowVector3d::Zero();
  left += joints.row(who.legs[0].hip) - joints.row(who.legs[1].hip);
  left += joints.row(who.arms[0].shoulder) - joints.row(who.arms[1].shoulder);
  left.y() = 0;
  if (left.norm() < 1e-6) {
    return Eigen::Vector3d::UnitZ();
  }
  const Eigen::Vector3d front =
      left.normalized().transpose().cross(Eigen::Vector3d::UnitY()).eval();
  const std::string& hip = skeleton.names[static_cast<std::size_t>(who.legs[0].hip)];
  if (role_of_name(hip).side >= 0) {
    return front;
  }
  const double floor = vertices.col(1).minCoeff();
  const double low = 0.05 * (vertices.col(1).maxCoeff() - floor);
  Eigen::RowVector3d feet = Eigen::RowVector3d::Zero();
  double count = 0;
  for (Index v = 0; v < vertices.rows(); ++v) {
    if (vertices(v, 1) < floor + low) {
      feet += vertices.row(v);
      count += 1;
    }
  }
  feet = feet / std::max(1.0, count) -
         (joints.row(who.legs[0].ankle) + joints.row(who.legs[1].ankle)) / 2;
  return feet.dot(front.transpose()) < 0 ? Eigen::Vector3d(-front) : front;
}

/// Every vertex to the joint whose bone is nearest: that of a joint goes to each of its children;
/// where two meet, the lower one has it.
SkinWeights nearest_bones(const Skeleton& skeleton, const Points& joints, const Points& vertices) {
  SkinWeights skin;
  skin.joints.resize(vertices.rows(), 1);
  skin.weights.setOnes(vertices.rows(), 1);
  for (Index v = 0; v < vertices.rows(); ++v) {
    double best = std::numeric_limits<double>::infinity();
    const auto offer = [&](int joint, const Eigen::RowVector3d& from,
                           const Eigen::RowVector3d& to) {
      const Eigen::RowVector3d bone = to - from;
      const double length = bone.squaredNorm();
      const double t =
          length > 0 ? std::clamp((vertices.row(v) - from).dot(bone) / length, 0.0, 1.0) : 0;
      const double distance = (from + t * bone - vertices.row(v)).norm();
      if (distance <= best + 1e-6) {
        best = std::min(best, distance);
        skin.joints(v, 0) = joint;
      }
    };
    for (std::size_t j = 0; j < skeleton.names.size(); ++j) {
      const auto row = static_cast<Index>(j);
      offer(static_cast<int>(j), joints.row(row), joints.row(row));
      if (skeleton.parents[j] >= 0) {
        const int parent = skeleton.parents[j];
        // The bone is the parent's; its end was offered to this one.
        offer(parent, joints.row(parent), 0.02 * joints.row(parent) + 0.98 * joints.row(row));
      }
    }
  }
  return skin;
}

/// Whether the skeleton has the knuckle that a point of a hand is at.
bool has_finger(const Humanoid& who, const std::string& name) {
  const std::array<std::string, kFingers> fingers = {"thumb", "index", "middle", "ring", "little"};
  const std::string part = name.substr(name.find('_') + 1);
  const Arm& arm = who.arms[name.starts_with("right_") ? 1 : 0];
  for (std::size_t f = 0; f < fingers.size(); ++f) {
    if (part.starts_with(fingers[f] + "_") && part.back() >= '1' && part.back() <= '4') {
      return arm.fingers[f][static_cast<std::size_t>(std::min(part.back() - '1', 2))] >= 0;
    }
  }
  return true;
}

/// A point as what moves with the body: a joint, the middle of two, or a place of the surface.
SequenceKeypoint riding(const std::string& name, const Eigen::Vector3d& point, const Points& joints,
                        const Humanoid& who, const TriangleTree& tree) {
  SequenceKeypoint keypoint;
  keypoint.name = name;
  if (name == "neck") {
    keypoint.joints = {who.arms[0].shoulder, who.arms[1].shoulder};
    return keypoint;
  }
  if (name == "mid_hip") {
    keypoint.joints = {who.legs[0].hip, who.legs[1].hip};
    return keypoint;
  }
  for (Index j = 0; j < joints.rows(); ++j) {
    if ((joints.row(j).transpose() - point).norm() < 1e-9) {
      keypoint.joints = {static_cast<int>(j), static_cast<int>(j)};
      return keypoint;
    }
  }
  // Where the point is not on the surface (a face from the front of the head), the nearest there.
  const ClosestPoint nearest = closest_point(tree, point);
  keypoint.face = nearest.face;
  keypoint.barycentric = nearest.barycentric;
  return keypoint;
}

/// Joints that have a keypoint's own name, for those that have no place yet.
void add_named(SequencePerson& person, const MeshSequenceFile& body) {
  for (std::size_t row = 0; row < body.names.size(); ++row) {
    const std::string name = body.names[row] == "pelvis" ? "mid_hip" : body.names[row];
    const bool placed =
        std::any_of(person.keypoints.begin(), person.keypoints.end(),
                    [&](const SequenceKeypoint& keypoint) { return keypoint.name == name; });
    if (placed || (find_keypoint(body_25_schema(), name) < 0 &&
                   find_keypoint(coco_wholebody_schema(), name) < 0)) {
      continue;
    }
    auto joint = std::find(person.rows.begin(), person.rows.end(), static_cast<int>(row));
    if (joint == person.rows.end()) {
      person.rows.push_back(static_cast<int>(row));
      joint = person.rows.end() - 1;
    }
    const auto at = static_cast<int>(joint - person.rows.begin());
    person.keypoints.push_back({name, {at, at}, -1, {}});
  }
}

/// Of joints that match no person, what is left.
SequencePerson without_person(const MeshSequenceFile& body) {
  constexpr std::size_t kShown = 8;
  SequencePerson person;
  person.problem = "the joints match no person by names or topology: ";
  for (std::size_t j = 0; j < std::min(kShown, body.names.size()); ++j) {
    person.problem += (j > 0 ? ", " : "") + body.names[j];
  }
  add_named(person, body);
  return person;
}

}  // namespace

SequencePerson sequence_person(const MeshSequenceFile& body) {
  SequencePerson person;
  if (body.joints.empty()) {
    person.problem = "the bodies have no joints";
    return person;
  }
  const Points& first = body.joints.front();
  BodyModel model;
  std::tie(model.skeleton, person.rows) = file_skeleton(body, first);
  const std::optional<Humanoid> found =
      person.rows.empty() ? std::nullopt : find_humanoid(model.skeleton);
  if (!found) {
    return without_person(body);
  }
  // Facing +Z, as a rest pose does.
  const Mesh mesh = frame(body.sequence, 0);
  const Eigen::Vector3d front =
      front_of(model.skeleton, *found, rest_positions(model.skeleton), mesh.vertices);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(-std::atan2(front.x(), front.z()), Eigen::Vector3d::UnitY())
          .toRotationMatrix();
  model.mesh.faces = body.shared.faces;
  model.mesh.vertices = mesh.vertices * turn.transpose();
  model.skeleton.offsets = (model.skeleton.offsets * turn.transpose()).eval();
  const std::optional<Humanoid> who = find_humanoid(model.skeleton);
  if (!who) {
    return without_person(body);
  }
  const Points joints = rest_positions(model.skeleton);
  model.skin = nearest_bones(model.skeleton, joints, model.mesh.vertices);
  person.skeleton = model.skeleton;
  const SubjectKeypoints places = subject_keypoints(model);
  const TriangleTree tree = build_tree(model.mesh.vertices, model.mesh.faces);
  for (std::size_t k = 0; k < places.names.size(); ++k) {
    if (has_finger(*who, places.names[k])) {
      person.keypoints.push_back(
          riding(places.names[k], places.places[k].rest, joints, *who, tree));
    }
  }
  add_named(person, body);
  return person;
}

Points person_joints(const SequencePerson& person, const Points& file_joints) {
  Points joints(static_cast<Index>(person.skeleton.names.size()), 3);
  for (Index j = 0; j < joints.rows(); ++j) {
    joints.row(j) = file_joints.row(person.rows[static_cast<std::size_t>(j)]);
  }
  return joints;
}

Points person_keypoints(const SequencePerson& person, const Points& file_joints,
                        const Points& vertices, const Triangles& faces) {
  Points points(static_cast<Index>(person.keypoints.size()), 3);
  for (std::size_t k = 0; k < person.keypoints.size(); ++k) {
    const SequenceKeypoint& keypoint = person.keypoints[k];
    const auto row = static_cast<Index>(k);
    if (keypoint.face < 0) {
      const auto joint = [&](std::size_t i) -> Eigen::RowVector3d {
        return file_joints.row(person.rows[static_cast<std::size_t>(keypoint.joints[i])]);
      };
      points.row(row) = (joint(0) + joint(1)) / 2;
      continue;
    }
    points.row(row).setZero();
    for (int c = 0; c < 3; ++c) {
      points.row(row) += keypoint.barycentric[c] * vertices.row(faces(keypoint.face, c));
    }
  }
  return points;
}

std::vector<std::string> sequence_person_lines(const SequencePerson& person,
                                               const std::string& schema) {
  constexpr std::size_t kShown = 12;
  std::vector<std::string> missing;
  const std::vector<std::string>& wanted = keypoint_schema(schema).points;
  for (const std::string& name : wanted) {
    if (std::none_of(person.keypoints.begin(), person.keypoints.end(),
                     [&](const SequenceKeypoint& keypoint) { return keypoint.name == name; })) {
      missing.push_back(name);
    }
  }
  std::vector<std::string> lines;
  if (!person.problem.empty()) {
    lines.push_back(person.problem + "; track cannot be judged");
  }
  lines.push_back("keypoints: " + std::to_string(wanted.size() - missing.size()) + " of the " +
                  std::to_string(wanted.size()) + " of " + schema);
  if (!missing.empty()) {
    std::string names;
    for (std::size_t i = 0; i < std::min(kShown, missing.size()); ++i) {
      names += (i > 0 ? ", " : "") + missing[i];
    }
    lines.push_back("no joint for the keypoints " + names +
                    (missing.size() > kShown
                         ? " and " + std::to_string(missing.size() - kShown) + " others"
                         : ""));
  }
  return lines;
}

}  // namespace atelier
