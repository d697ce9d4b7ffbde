#include "bodymodel/formats/marker_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>

#include "bodymodel/human/human_anatomy.h"
#include "bodymodel/human/human_rig.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"

namespace atelier {
namespace {

struct MarkerRow {
  const char* joint;  // without side for what has one
  double x, y, z;     // of the left side
  bool centre = false;
};
using Table = std::map<std::string, MarkerRow>;

// On the middle of the body.
const Table& middle_table() {
  static const MarkerRow top = {"head", 0, 106, 5};
  static const MarkerRow sacrum = {"pelvis", 0, 27, -62};
  static const MarkerRow hips = {"pelvis", 0, -18, -5};
  static const Table table = {
      {"hip", hips},
      {"midhip", hips},
      {"chip", hips},
      {"hips", hips},
      {"pelvis", hips},
      {"root", hips},
      {"neck", {"neck", 0, 0, 0}},
      {"upperneck", {"head", 0, -5, 0}},
      {"head", top},
      {"headtop", top},
      {"tophead", top},
      {"toph", top},
      {"arie", top},
      {"ariel", top},
      {"nose", {"head", 0, 22, 73}},
      {"c7", {"spine3", 0, 118, -44}},
      {"t10", {"spine3", 0, 0, -62}},
      {"t8", {"spine3", 0, 25, -62}},
      {"clav", {"spine3", 0, 91, 25}},
      {"strn", {"spine3", 0, 11, 58}},
      {"sternum", {"spine3", 0, 60, 45}},
      {"rbak", {"spine3", -50, 46, -68}},
      {"rback", {"spine3", -50, 46, -68}},
      {"rbac", {"spine3", -50, 46, -68}},
      {"sacr", sacrum},
      {"vsac", sacrum},
      {"vsacral", sacrum},
      {"sacrum", sacrum},
      {"sacral", sacrum},
      // Theia3D's segments: origins, and points 0.1 m ahead of them (motion_c3d.h).
      {"pelvis4x4", hips},
      {"pelvis4x4y", {"pelvis", 0, -18, 52}},
      {"torso4x4", {"spine3", 0, 115, -10}},
      {"torso4x4y", {"spine3", 0, 115, 47}},
      {"head4x4", {"head", 0, 31, -2}},
      {"head4x4y", {"head", 0, 31, 55}},
      // Qualisys' sets, after van Sint Jan, "Color atlas of skeletal landmark definitions", 2007.
      {"cv7", {"spine3", 0, 118, -44}},
      {"tv8", {"spine3", 0, 25, -62}},
      {"tv10", {"spine3", 0, 0, -62}},
      {"sjn", {"spine3", 0, 91, 25}},
      {"snj", {"spine3", 0, 91, 25}},
      {"sxs", {"spine3", 0, 11, 58}},
  };
  return table;
}

// Where markers of a side sit; places are the left side's.
constexpr MarkerRow kHip = {"hip", 0, 0, 0, true};
constexpr MarkerRow kKnee = {"knee", 0, 0, 0, true};
constexpr MarkerRow kAnkle = {"ankle", 0, 0, 0, true};
constexpr MarkerRow kShoulder = {"shoulder", 0, 0, 0, true};
constexpr MarkerRow kElbow = {"elbow", 0, 0, 0, true};
constexpr MarkerRow kWrist = {"wrist", 0, 0, 0, true};
constexpr MarkerRow kAsis = {"pelvis", 70, 25, 55};
constexpr MarkerRow kPsis = {"pelvis", 28, 27, -60};
constexpr MarkerRow kKneeOut = {"knee", 32, 0, 0};
constexpr MarkerRow kKneeIn = {"knee", -30, 0, 0};
constexpr MarkerRow kAnkleOut = {"ankle", 22, -2, -5};
constexpr MarkerRow kAnkleIn = {"ankle", -20, 3, 2};
constexpr MarkerRow kHeel = {"ankle", -2, -25, -34};
constexpr MarkerRow kToeTip = {"foot", -14, -3, 34};
constexpr MarkerRow kToeBig = {"foot", -16, 0, 2};
constexpr MarkerRow kToeSmall = {"foot", 22, -5, 6};
constexpr MarkerRow kAcromion = {"collar", 82, 25, -8};
constexpr MarkerRow kElbowOut = {"elbow", 17, 17, -4};
constexpr MarkerRow kElbowIn = {"elbow", -14, -14, 0};
constexpr MarkerRow kWristThumb = {"wrist", 0, 0, 18};
constexpr MarkerRow kWristLittle = {"wrist", 0, 0, -18};
constexpr MarkerRow kThigh = {"hip", 54, -120, 0};
constexpr MarkerRow kThighFront = {"hip", 9, -130, 50};
constexpr MarkerRow kThighBack = {"hip", 40, -150, -20};
constexpr MarkerRow kShank = {"knee", 35, -110, 0};
constexpr MarkerRow kShankFront = {"knee", 5, -90, 30};
constexpr MarkerRow kShankBack = {"knee", 25, -120, -25};
constexpr MarkerRow kFinger = {"wrist", 42, -28, 5};

// Of a side: what laboratories and detectors call these places.
const Table& side_table() {
  static const Table table = {
      // Joint centres and keypoints.
      {"hip", kHip},
      {"hjc", kHip},
      {"knee", kKnee},
      {"kjc", kKnee},
      {"ankle", kAnkle},
      {"ajc", kAnkle},
      {"shoulder", kShoulder},
      {"sjc", kShoulder},
      {"elbow", kElbow},
      {"ejc", kElbow},
      {"wrist", kWrist},
      {"wjc", kWrist},
      {"bigtoe", {"foot", -14, -2, 28}},
      {"smalltoe", {"foot", 23, -7, 9}},
      {"heel", kHeel},
      {"eye", {"head", 18, 42, 55}},
      {"ear", {"head", 46, 31, -2}},
      // Plug-in Gait, with medial and cluster markers that laboratories add.
      {"asi", kAsis},
      {"asis", kAsis},
      {"psi", kPsis},
      {"psis", kPsis},
      {"thi", kThigh},
      {"kne", kKneeOut},
      {"mkne", kKneeIn},
      {"knm", kKneeIn},
      {"kneem", kKneeIn},
      {"tib", kShank},
      {"ank", kAnkleOut},
      {"mank", kAnkleIn},
      {"anm", kAnkleIn},
      {"mma", kAnkleIn},
      {"hee", kHeel},
      {"toe", {"ankle", 3, -15, 72}},
      {"mt1", kToeBig},
      {"mt5", kToeSmall},
      {"sho", kAcromion},
      {"upa", {"shoulder", 77, -37, 0}},
      {"elb", kElbowOut},
      {"melb", kElbowIn},
      {"elbm", kElbowIn},
      {"frm", {"elbow", 62, -37, 0}},
      {"fra", {"elbow", 62, -37, 0}},
      {"wra", kWristThumb},
      {"wrb", kWristLittle},
      {"fin", kFinger},
      {"fhd", {"head", 32, 60, 55}},
      {"bhd", {"head", 32, 60, -50}},
      // CMU: a belt instead of the hip bones, shins.
      {"fwt", kAsis},
      {"bwt", kPsis},
      {"shn", kShank},
      // OpenSim: gait2392 and Rajagopal.
      {"acromium", kAcromion},
      {"acromion", kAcromion},
      {"acr", kAcromion},
      {"bicep", {"shoulder", 50, -60, 25}},
      {"elbowlat", kElbowOut},
      {"elbowmed", kElbowIn},
      {"lel", kElbowOut},
      {"mel", kElbowIn},
      {"wristlat", kWristThumb},
      {"wristmed", kWristLittle},
      {"faradius", kWristThumb},
      {"faulna", kWristLittle},
      {"thighupper", kThigh},
      {"thighfront", kThighFront},
      {"thighrear", kThighBack},
      {"th1", kThigh},
      {"th2", kThighFront},
      {"th3", kThighBack},
      {"kneelat", kKneeOut},
      {"kneemed", kKneeIn},
      {"lfc", kKneeOut},
      {"mfc", kKneeIn},
      {"shankupper", kShank},
      {"shankfront", kShankFront},
      {"shankrear", kShankBack},
      {"tb1", kShank},
      {"tb2", kShankFront},
      {"tb3", kShankBack},
      {"anklelat", kAnkleOut},
      {"anklemed", kAnkleIn},
      {"lmal", kAnkleOut},
      {"mmal", kAnkleIn},
      {"cal", kHeel},
      {"midfootsup", {"ankle", 3, -5, 50}},
      {"midfootlat", {"ankle", 27, -28, 35}},
      {"toelat", kToeSmall},
      {"toemed", kToeBig},
      {"toetip", kToeTip},
  };
  return table;
}

// Of a side: what programs of a maker call them.
const Table& makers_side_table() {
  static const Table table = {
      // Theia3D's segments, as above; the hand's second axis is the palm's.
      {"thigh4x4", kHip},
      {"shank4x4", kKnee},
      {"foot4x4", kAnkle},
      {"foot4x4y", {"ankle", 0, 0, 57}},
      {"toes4x4", {"foot", 0, 0, 0}},
      {"uarm4x4", kShoulder},
      {"larm4x4", kElbow},
      {"hand4x4", kWrist},
      {"hand4x4y", {"wrist", -31, -47, 0}},
      // Qualisys' sets, as above.
      {"ias", kAsis},
      {"ips", kPsis},
      {"ftc", {"hip", 50, -5, 0}},
      {"fle", kKneeOut},
      {"fme", kKneeIn},
      {"ttc", {"knee", 5, -35, 28}},
      {"fax", {"knee", 28, -25, -8}},
      {"fal", kAnkleOut},
      {"tam", kAnkleIn},
      {"fcc", kHeel},
      {"fm1", kToeBig},
      {"fm5", kToeSmall},
      {"sae", kAcromion},
      {"saj", kAcromion},
      {"hle", kElbowOut},
      {"hme", kElbowIn},
      {"rsp", kWristThumb},
      {"usp", kWristLittle},
      {"uhe", kWristLittle},
      {"hm2", kFinger},
      {"hm5", {"wrist", 40, -27, -20}},
      {"hdf", {"head", 32, 60, 55}},
      {"hdb", {"head", 32, 60, -50}},
  };
  return table;
}

const MarkerRow* side_row(const std::string& text) {
  for (const Table* table : {&side_table(), &makers_side_table()}) {
    if (const auto found = table->find(text); found != table->end()) {
      return &found->second;
    }
  }
  return nullptr;
}

std::string plain(const std::string& name) {
  std::string text;
  for (const char c : name.substr(name.rfind(':') == std::string::npos ? 0 : name.rfind(':') + 1)) {
    const unsigned char letter = static_cast<unsigned char>(c);
    if (std::isalnum(letter) != 0) {
      text += static_cast<char>(std::tolower(letter));
    }
  }
  return text;
}

MarkerPlace placed(const MarkerRow& row, int side) {
  const std::string prefix = side < 0 ? "" : side == 0 ? "left_" : "right_";
  const bool middle =
      std::string_view(row.joint) == "pelvis" || std::string_view(row.joint) == "head" ||
      std::string_view(row.joint) == "neck" || std::string_view(row.joint).starts_with("spine");
  return {
      (middle ? "" : prefix) + row.joint, {side == 1 ? -row.x : row.x, row.y, row.z}, row.centre};
}

}  // namespace

std::optional<MarkerPlace> marker_place(const std::string& name) {
  const std::string text = plain(name);
  if (const auto found = middle_table().find(text); found != middle_table().end()) {
    return placed(found->second, -1);
  }
  const std::pair<const char*, int> sides[] = {{"left", 0}, {"right", 1}, {"l", 0}, {"r", 1}};
  for (const auto& [word, side] : sides) {
    const std::string affix = word;
    if (text.starts_with(affix)) {
      if (const MarkerRow* row = side_row(text.substr(affix.size()))) {
        return placed(*row, side);
      }
    }
  }
  for (const auto& [word, side] : sides) {
    const std::string affix = word;
    if (text.ends_with(affix)) {
      if (const MarkerRow* row = side_row(text.substr(0, text.size() - affix.size()))) {
        return placed(*row, side);
      }
    }
  }
  return std::nullopt;
}

namespace {

constexpr int kPosedJoints = 22;  // of the default human: what comes before jaw, eyes, fingers

// Behind what all have before a separator in common: "mixamorig_".
std::vector<std::string> without_common_prefix(const std::vector<std::string>& names) {
  std::size_t common = names.empty() ? 0 : names.front().size();
  for (const std::string& name : names) {
    const auto [end, other] =
        std::mismatch(name.begin(), name.end(), names.front().begin(), names.front().end());
    common = std::min(common, static_cast<std::size_t>(end - name.begin()));
  }
  const std::string first = names.empty() ? std::string() : names.front().substr(0, common);
  const std::size_t separator = first.find_last_of("_:. -");
  std::vector<std::string> rest;
  for (const std::string& name : names) {
    rest.push_back(separator == std::string::npos ? name : name.substr(separator + 1));
  }
  return rest;
}

bool are_joints(const NamedLimbs& limbs, const std::vector<std::string>& names) {
  bool whole = limbs.head >= 0;
  bool skeletal = true;
  for (std::size_t side = 0; side < 2; ++side) {
    const Leg& leg = limbs.legs[side];
    const Arm& arm = limbs.arms[side];
    whole = whole && leg.hip >= 0 && leg.knee >= 0 && leg.ankle >= 0 && arm.shoulder >= 0 &&
            arm.elbow >= 0 && arm.wrist >= 0;
    skeletal =
        skeletal && (arm.collar >= 0 ||
                     (leg.hip >= 0 &&
                      role_of_name(names[static_cast<std::size_t>(leg.hip)]).role == "upper_leg"));
  }
  return whole && skeletal;
}

// The default human's joints by name: those of the body, and what these carry stiffly.
std::map<std::string, MarkerPlace> default_joint_places() {
  const HumanAnatomy anatomy = human_anatomy({});
  const Skeleton skeleton = human_skeleton(anatomy);
  const Points rest = rest_positions(skeleton);
  std::map<std::string, MarkerPlace> places;
  for (std::size_t j = 0; j < skeleton.names.size(); ++j) {
    const int carrier =
        static_cast<int>(j) < kPosedJoints ? static_cast<int>(j) : skeleton.parents[j];
    if (carrier < kPosedJoints) {
      MarkerPlace& place = places[skeleton.names[j]];
      place.joint = skeleton.names[static_cast<std::size_t>(carrier)];
      place.offset = (rest.row(static_cast<Index>(j)) - rest.row(carrier)).transpose() /
                     (anatomy.build.stature / 1000);
      place.centre = carrier == static_cast<int>(j);
    }
  }
  return places;
}

}  // namespace

std::vector<std::optional<MarkerPlace>> marker_places(const std::vector<std::string>& names) {
  std::vector<std::optional<MarkerPlace>> places;
  const std::vector<std::string> plain_names = without_common_prefix(names);
  const NamedLimbs limbs = limbs_of_names(plain_names);
  if (!are_joints(limbs, plain_names)) {
    for (const std::string& name : names) {
      places.push_back(marker_place(name));
    }
    return places;
  }
  static const std::map<std::string, MarkerPlace> own = default_joint_places();
  for (const std::string& name : plain_names) {
    const auto found = own.find(name.substr(name.rfind(':') + 1));
    places.push_back(found != own.end() ? std::optional(found->second) : marker_place(name));
  }
  const auto set = [&](int joint, const std::string& place, bool centre) {
    if (joint >= 0 && !own.contains(plain_names[static_cast<std::size_t>(joint)])) {
      places[static_cast<std::size_t>(joint)] = {place, Eigen::Vector3d::Zero(), centre};
    }
  };
  set(limbs.head, "head", false);
  for (std::size_t side = 0; side < 2; ++side) {
    const std::string prefix = side == 0 ? "left_" : "right_";
    const Leg& leg = limbs.legs[side];
    const Arm& arm = limbs.arms[side];
    set(leg.hip, prefix + "hip", true);
    set(leg.knee, prefix + "knee", true);
    set(leg.ankle, prefix + "ankle", true);
    set(leg.toe, prefix + "foot", false);
    set(arm.collar, prefix + "collar", false);
    set(arm.shoulder, prefix + "shoulder", true);
    set(arm.elbow, prefix + "elbow", true);
    set(arm.wrist, prefix + "wrist", true);
  }
  return places;
}

}  // namespace atelier
