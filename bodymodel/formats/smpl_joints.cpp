#include "bodymodel/formats/smpl.h"
#include "core/error.h"

namespace atelier {
namespace {

struct NamedJoint {
  const char* name;
  int parent;
};

constexpr NamedJoint kBody[22] = {
    {"pelvis", -1},        {"left_hip", 0},        {"right_hip", 0},    {"spine1", 0},
    {"left_knee", 1},      {"right_knee", 2},      {"spine2", 3},       {"left_ankle", 4},
    {"right_ankle", 5},    {"spine3", 6},          {"left_foot", 7},    {"right_foot", 8},
    {"neck", 9},           {"left_collar", 9},     {"right_collar", 9}, {"head", 12},
    {"left_shoulder", 13}, {"right_shoulder", 14}, {"left_elbow", 16},  {"right_elbow", 17},
    {"left_wrist", 18},    {"right_wrist", 19}};

std::vector<NamedJoint> joints_of(Index joints, std::vector<std::string>& storage) {
  ATELIER_CHECK(joints == 24 || joints == 52 || joints == 55,
                "the SMPL family has 24, 52 or 55 joints, not " + std::to_string(joints));
  std::vector<NamedJoint> all(std::begin(kBody), std::end(kBody));
  if (joints == 24) {
    all.push_back({"left_hand", 20});
    all.push_back({"right_hand", 21});
    return all;
  }
  if (joints == 55) {
    all.push_back({"jaw", 15});
    all.push_back({"left_eye_smplhf", 15});
    all.push_back({"right_eye_smplhf", 15});
  }
  storage.reserve(30);
  for (const char* side : {"left", "right"}) {
    for (const char* finger : {"index", "middle", "pinky", "ring", "thumb"}) {
      for (int knuckle = 1; knuckle <= 3; ++knuckle) {
        storage.push_back(std::string(side) + "_" + finger + std::to_string(knuckle));
        const int parent =
            knuckle > 1 ? static_cast<int>(all.size()) - 1 : (side[0] == 'l' ? 20 : 21);
        all.push_back({storage.back().c_str(), parent});
      }
    }
  }
  return all;
}

}  // namespace

std::vector<std::string> smpl_joint_names(Index joints) {
  std::vector<std::string> storage;
  std::vector<std::string> names;
  for (const NamedJoint& joint : joints_of(joints, storage)) {
    names.push_back(joint.name);
  }
  return names;
}

std::vector<int> smpl_parents(Index joints) {
  std::vector<std::string> storage;
  std::vector<int> parents;
  for (const NamedJoint& joint : joints_of(joints, storage)) {
    parents.push_back(joint.parent);
  }
  return parents;
}

}  // namespace atelier
