#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/skeleton.h"

namespace atelier {

/// Which joints of a skeleton are a person's; -1 where there is none. A joint is where its bone
/// begins: `knee` turns the shin.
struct Leg {
  int hip = -1, knee = -1, ankle = -1, toe = -1;
};
struct Arm {
  int collar = -1, shoulder = -1, elbow = -1, wrist = -1;
  std::array<std::array<int, 3>, 5> fingers = {};  ///< thumb, index, middle, ring, little; knuckles
};
struct Humanoid {
  std::vector<int> spine;   ///< from the pelvis (where legs and trunk meet) up to the chest (where
                            ///< arms and neck meet), at least one joint
  std::vector<int> neck;    ///< from the first joint above the chest up to the head; the last is it
  std::array<Leg, 2> legs;  ///< left, right
  std::array<Arm, 2> arms;
};

/// The joint in a person's skeleton that a name means, without side: "hip", "knee", ...; "" if
/// none. Exposed for tests.
struct NamedRole {
  int side = -1;     ///< 0 left, 1 right, -1 none
  std::string role;  ///< "upper_leg", "thumb_1", ...
};
NamedRole role_of_name(const std::string& name);

/// Limbs and head as names alone say, -1 where they do not: of names that mean different joints in
/// different rigs ("shoulder", "foot") the others decide.
struct NamedLimbs {
  std::array<Leg, 2> legs;  ///< left, right
  std::array<Arm, 2> arms;
  int head = -1;
};
NamedLimbs limbs_of_names(const std::vector<std::string>& names);

/// Finds a person in a skeleton: by the names that MakeHuman, MPFB2, Mixamo, CMU (BVH and ASF),
/// Unreal, Rokoko, Poser, SMPL, glTF samples and OpenPose-like rigs use, whatever their case and
/// prefixes; failing these, by topology: two equal chains hang on the pelvis and two on the chest
/// (left is +X for a rest pose that faces +Z). Nothing if neither finds two legs, two arms and a
/// head.
std::optional<Humanoid> find_humanoid(const Skeleton& skeleton);

/// The same; throws DataError that lists the joint names if there is no person.
Humanoid recognised_humanoid(const Skeleton& skeleton, const std::string& file = "");

/// The skeleton with the person's joints named as SMPL names them ("pelvis", "left_hip", ...),
/// which is what measure.h looks for; other joints of such a name get "_other" behind theirs.
Skeleton with_smpl_names(const Skeleton& skeleton, const Humanoid& humanoid);

/// Mean length of thigh plus shin, in the skeleton's unit: what scales one person to another.
double leg_length(const Skeleton& skeleton, const Humanoid& humanoid);

}  // namespace atelier
