#include "pipeline/outfit/wearer_anatomy.h"

#include <algorithm>
#include <set>
#include <vector>

#include "bodymodel/humanoid.h"
#include "core/error.h"

namespace atelier {

BodyAnatomy anatomy_of(const BodyModel& model) {
  const Humanoid who = recognised_humanoid(model.skeleton, model.name);
  const std::vector<int>& trunk = who.spine;
  BodyAnatomy anatomy;
  const auto limb = [&](Extremity extremity, const std::vector<int>& joints, bool through_trunk) {
    std::vector<int> lumps = through_trunk ? trunk : std::vector<int>{trunk.front()};
    lumps.insert(lumps.end(), joints.begin(), joints.end());
    anatomy.limbs[static_cast<std::size_t>(extremity)] = lumps;
  };
  limb(Extremity::Head, who.neck, true);
  const auto arm = [&](Extremity extremity, const Arm& a) {
    limb(extremity, {a.collar, a.shoulder, a.elbow, a.wrist}, true);
  };
  const auto leg = [&](Extremity extremity, const Leg& l) {
    limb(extremity, {l.hip, l.knee, l.ankle}, false);
  };
  arm(Extremity::LeftHand, who.arms[0]);
  arm(Extremity::RightHand, who.arms[1]);
  leg(Extremity::LeftFoot, who.legs[0]);
  leg(Extremity::RightFoot, who.legs[1]);
  std::set<int> known;
  for (const std::vector<int>& lumps : anatomy.limbs) {
    known.insert(lumps.begin(), lumps.end());
  }
  std::vector<int> lump_of_joint(model.skeleton.parents.size(), trunk.front());
  for (std::size_t j = 0; j < lump_of_joint.size(); ++j) {
    int joint = static_cast<int>(j);
    while (joint >= 0 && !known.contains(joint)) {
      joint = model.skeleton.parents[static_cast<std::size_t>(joint)];
    }
    lump_of_joint[j] = joint >= 0 ? joint : trunk.front();
  }
  std::set<int> used;
  for (Index v = 0; v < vertex_count(model); ++v) {
    Index slot = 0;
    model.skin.weights.row(v).maxCoeff(&slot);
    const int lump = lump_of_joint[static_cast<std::size_t>(model.skin.joints(v, slot))];
    anatomy.lumps.push_back(lump);
    used.insert(lump);
  }
  for (std::vector<int>& lumps :
       anatomy.limbs) {  // joints that move no vertex most are passed over
    std::erase_if(lumps, [&](int lump) { return !used.contains(lump); });
    if (lumps.size() < 2) {
      throw DataError(model.name, "skin", "a limb or the head moves no vertex",
                      "a body with arms, legs and a head, each moved by its joints");
    }
  }
  return anatomy;
}

}  // namespace atelier
