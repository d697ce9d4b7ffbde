#include "bodymodel/humanoid.h"

#include <algorithm>
#include <map>

#include "bodymodel/kinematics.h"
#include "core/error.h"

namespace atelier {
namespace {

int parent_of(const Skeleton& skeleton, int joint) {
  return skeleton.parents[static_cast<std::size_t>(joint)];
}

std::vector<int> path_up(const Skeleton& skeleton, int joint) {
  std::vector<int> path;
  for (; joint >= 0; joint = parent_of(skeleton, joint)) {
    path.push_back(joint);
  }
  return path;
}

int common_ancestor(const Skeleton& skeleton, int a, int b) {
  const std::vector<int> above = path_up(skeleton, a);
  for (int joint = b; joint >= 0; joint = parent_of(skeleton, joint)) {
    if (std::find(above.begin(), above.end(), joint) != above.end()) {
      return joint;
    }
  }
  return 0;
}

// Joints from `top` down to `bottom`, both included; empty if bottom does not hang on top.
std::vector<int> path_down(const Skeleton& skeleton, int top, int bottom) {
  std::vector<int> path = path_up(skeleton, bottom);
  const auto end = std::find(path.begin(), path.end(), top);
  if (end == path.end()) {
    return {};
  }
  path.erase(end + 1, path.end());
  std::reverse(path.begin(), path.end());
  return path;
}

using Roles = std::map<std::string, int>;  // the joint that has a role on one side

int take(const Roles& roles, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    const auto found = roles.find(name);
    if (found != roles.end()) {
      return found->second;
    }
  }
  return -1;
}

Leg leg_of(const Roles& roles) {
  Leg leg;
  leg.hip = take(roles, {"upper_leg", "hip"});
  if (leg.hip < 0 && roles.contains("lower_leg")) {
    leg.hip = take(roles, {"leg"});
  }
  leg.knee = take(roles, {"lower_leg", "leg"});
  if (leg.knee == leg.hip) {
    leg.knee = -1;
  }
  leg.ankle = take(roles, {"ankle", "foot"});
  leg.toe = take(roles, {"toe"});
  if (leg.toe < 0 && roles.contains("ankle")) {
    leg.toe = take(roles, {"foot"});  // SMPL: ankle, then foot
  }
  return leg;
}

Arm arm_of(const Roles& roles) {
  Arm arm;
  arm.shoulder = take(roles, {"upper_arm", "shoulder"});
  arm.collar = take(roles, {"collar"});
  if (arm.collar < 0 && roles.contains("upper_arm")) {
    arm.collar = take(roles, {"shoulder"});  // Mixamo, CMU: shoulder, then arm
  }
  arm.elbow = take(roles, {"lower_arm"});
  arm.wrist = take(roles, {"wrist", "hand"});
  const char* fingers[5] = {"thumb", "index", "middle", "ring", "little"};
  for (std::size_t f = 0; f < 5; ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string role = std::string(fingers[f]) + "_" + std::to_string(k + 1);
      arm.fingers[f][k] = take(roles, {role.c_str()});
    }
  }
  return arm;
}

// Fills in what follows from legs, arms and head.
bool complete(const Skeleton& skeleton, int head, Humanoid& humanoid) {
  for (int side = 0; side < 2; ++side) {
    const Leg& leg = humanoid.legs[static_cast<std::size_t>(side)];
    const Arm& arm = humanoid.arms[static_cast<std::size_t>(side)];
    if (leg.hip < 0 || leg.knee < 0 || leg.ankle < 0 || arm.shoulder < 0 || arm.elbow < 0 ||
        arm.wrist < 0) {
      return false;
    }
    if (path_down(skeleton, leg.hip, leg.knee).empty() ||
        path_down(skeleton, leg.knee, leg.ankle).empty() ||
        path_down(skeleton, arm.shoulder, arm.elbow).empty() ||
        path_down(skeleton, arm.elbow, arm.wrist).empty()) {
      return false;
    }
  }
  if (head < 0) {
    return false;
  }
  const int hips = common_ancestor(skeleton, humanoid.legs[0].hip, humanoid.legs[1].hip);
  const int pelvis = common_ancestor(skeleton, hips, head);
  const int shoulders =
      common_ancestor(skeleton, humanoid.arms[0].shoulder, humanoid.arms[1].shoulder);
  const int chest = common_ancestor(skeleton, shoulders, head);
  humanoid.spine = path_down(skeleton, pelvis, chest);
  humanoid.neck = path_down(skeleton, chest, head);
  if (humanoid.spine.empty() || humanoid.neck.size() < 2) {
    return false;
  }
  humanoid.neck.erase(humanoid.neck.begin());
  return true;
}

std::optional<Humanoid> by_names(const Skeleton& skeleton) {
  const NamedLimbs limbs = limbs_of_names(skeleton.names);
  Humanoid humanoid;
  humanoid.legs = limbs.legs;
  humanoid.arms = limbs.arms;
  if (complete(skeleton, limbs.head, humanoid)) {
    return humanoid;
  }
  return std::nullopt;
}

// A chain of joints that hangs on a branching joint, and its length.
struct Chain {
  std::vector<int> joints;
  double length = 0;
};

// From `joint` down the longest way.
Chain longest_chain(const Skeleton& skeleton, int joint) {
  Chain best;
  for (std::size_t child = static_cast<std::size_t>(joint) + 1; child < skeleton.parents.size();
       ++child) {
    if (skeleton.parents[child] == joint) {
      Chain below = longest_chain(skeleton, static_cast<int>(child));
      below.length += skeleton.offsets.row(static_cast<Index>(child)).norm();
      if (below.length > best.length) {
        best = std::move(below);
      }
    }
  }
  best.joints.insert(best.joints.begin(), joint);
  return best;
}

std::vector<int> children_of(const Skeleton& skeleton, int joint) {
  std::vector<int> children;
  for (std::size_t child = 0; child < skeleton.parents.size(); ++child) {
    if (skeleton.parents[child] == joint) {
      children.push_back(static_cast<int>(child));
    }
  }
  return children;
}

// Two limbs of nearly equal length, three joints or more, on opposite sides, and the chain between.
struct Branching {
  Chain limbs[2];  // left (+X), right
  int trunk = -1;
};

std::optional<Branching> branching_at(const Skeleton& skeleton, const Points& rest, int joint) {
  const std::vector<int> children = children_of(skeleton, joint);
  constexpr double kEqual = 0.05;
  for (std::size_t a = 0; a < children.size(); ++a) {
    for (std::size_t b = a + 1; b < children.size(); ++b) {
      Chain first = longest_chain(skeleton, children[a]);
      Chain second = longest_chain(skeleton, children[b]);
      if (first.joints.size() < 3 || second.joints.size() != first.joints.size() ||
          std::abs(first.length - second.length) > kEqual * (first.length + second.length)) {
        continue;
      }
      const double xa = rest(first.joints.back(), 0);
      const double xb = rest(second.joints.back(), 0);
      if (std::abs(xa - xb) < 1e-6) {
        continue;
      }
      Branching branching;
      branching.limbs[xa > xb ? 0 : 1] = first;
      branching.limbs[xa > xb ? 1 : 0] = second;
      double longest = 0;
      for (std::size_t c = 0; c < children.size(); ++c) {
        const double length =
            longest_chain(skeleton, children[c]).length + skeleton.offsets.row(children[c]).norm();
        if (c != a && c != b && length > longest) {
          longest = length;
          branching.trunk = children[c];
        }
      }
      if (branching.trunk >= 0) {
        return branching;
      }
    }
  }
  return std::nullopt;
}

std::optional<Humanoid> by_topology(const Skeleton& skeleton) {
  const Points rest = rest_positions(skeleton);
  for (int pelvis = 0; pelvis < static_cast<int>(skeleton.names.size()); ++pelvis) {
    const std::optional<Branching> legs = branching_at(skeleton, rest, pelvis);
    if (!legs) {
      continue;
    }
    for (int chest = legs->trunk; chest < static_cast<int>(skeleton.names.size()); ++chest) {
      if (path_down(skeleton, legs->trunk, chest).empty()) {
        continue;
      }
      const std::optional<Branching> arms = branching_at(skeleton, rest, chest);
      if (!arms) {
        continue;
      }
      Humanoid humanoid;
      for (std::size_t side = 0; side < 2; ++side) {
        const std::vector<int>& leg = legs->limbs[side].joints;
        humanoid.legs[side] = {leg[0], leg[1], leg[2], leg.size() > 3 ? leg[3] : -1};
        const std::vector<int>& arm = arms->limbs[side].joints;
        const std::size_t first = arm.size() > 3 ? 1 : 0;  // a collar comes first
        Arm& found = humanoid.arms[side];
        found.collar = first == 1 ? arm[0] : -1;
        found.shoulder = arm[first];
        found.elbow = arm[first + 1];
        found.wrist = arm[first + 2];
        for (std::array<int, 3>& finger : found.fingers) {
          finger.fill(-1);
        }
      }
      const int head = longest_chain(skeleton, arms->trunk).joints.back();
      if (complete(skeleton, head, humanoid)) {
        return humanoid;
      }
    }
  }
  return std::nullopt;
}

}  // namespace

NamedLimbs limbs_of_names(const std::vector<std::string>& names) {
  Roles roles[2];
  NamedLimbs limbs;
  for (std::size_t j = 0; j < names.size(); ++j) {
    const NamedRole role = role_of_name(names[j]);
    if (role.role == "head" && limbs.head < 0) {
      limbs.head = static_cast<int>(j);
    } else if (role.side >= 0) {
      roles[role.side].emplace(role.role, static_cast<int>(j));
    }
  }
  for (std::size_t side = 0; side < 2; ++side) {
    limbs.legs[side] = leg_of(roles[side]);
    limbs.arms[side] = arm_of(roles[side]);
  }
  return limbs;
}

std::optional<Humanoid> find_humanoid(const Skeleton& skeleton) {
  std::optional<Humanoid> humanoid = by_names(skeleton);
  return humanoid ? humanoid : by_topology(skeleton);
}

Humanoid recognised_humanoid(const Skeleton& skeleton, const std::string& file) {
  std::optional<Humanoid> humanoid = find_humanoid(skeleton);
  if (!humanoid) {
    std::string names;
    for (std::size_t j = 0; j < skeleton.names.size() && j < 12; ++j) {
      names += (j > 0 ? ", " : "") + skeleton.names[j];
    }
    throw DataError(file, "skeleton", "joints that match no person: " + names,
                    "two legs, two arms and a head, by known names or by topology");
  }
  return *humanoid;
}

Skeleton with_smpl_names(const Skeleton& skeleton, const Humanoid& humanoid) {
  std::map<int, std::string> names = {{humanoid.spine.front(), "pelvis"},
                                      {humanoid.neck.back(), "head"}};
  if (humanoid.neck.size() > 1) {
    names[humanoid.neck.front()] = "neck";
  }
  for (std::size_t side = 0; side < 2; ++side) {
    const std::string prefix = side == 0 ? "left_" : "right_";
    const Leg& leg = humanoid.legs[side];
    const Arm& arm = humanoid.arms[side];
    const std::pair<int, const char*> joints[] = {
        {leg.hip, "hip"},     {leg.knee, "knee"},     {leg.ankle, "ankle"},
        {leg.toe, "foot"},    {arm.collar, "collar"}, {arm.shoulder, "shoulder"},
        {arm.elbow, "elbow"}, {arm.wrist, "wrist"}};
    for (const auto& [joint, name] : joints) {
      if (joint >= 0) {
        names[joint] = prefix + name;
      }
    }
  }
  Skeleton renamed = skeleton;
  for (const auto& [joint, name] : names) {
    const int other = find_joint(renamed, name);
    if (other >= 0 && other != joint) {
      renamed.names[static_cast<std::size_t>(other)] += "_other";
    }
    renamed.names[static_cast<std::size_t>(joint)] = name;
  }
  return renamed;
}

double leg_length(const Skeleton& skeleton, const Humanoid& humanoid) {
  const Points rest = rest_positions(skeleton);
  double sum = 0;
  for (const Leg& leg : humanoid.legs) {
    sum += (rest.row(leg.hip) - rest.row(leg.knee)).norm() +
           (rest.row(leg.knee) - rest.row(leg.ankle)).norm();
  }
  return sum / 2;
}

}  // namespace atelier
