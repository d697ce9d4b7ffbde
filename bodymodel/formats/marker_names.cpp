#include "bodymodel/formats/marker_names.h"

#include <cctype>
#include <map>

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
  };
  return table;
}

// Of a side; places are the left side's.
const Table& side_table() {
  static const MarkerRow hip = {"hip", 0, 0, 0, true};
  static const MarkerRow knee = {"knee", 0, 0, 0, true};
  static const MarkerRow ankle = {"ankle", 0, 0, 0, true};
  static const MarkerRow shoulder = {"shoulder", 0, 0, 0, true};
  static const MarkerRow elbow = {"elbow", 0, 0, 0, true};
  static const MarkerRow wrist = {"wrist", 0, 0, 0, true};
  static const MarkerRow asis = {"pelvis", 70, 25, 55};
  static const MarkerRow psis = {"pelvis", 28, 27, -60};
  static const MarkerRow knee_out = {"knee", 32, 0, 0};
  static const MarkerRow knee_in = {"knee", -30, 0, 0};
  static const MarkerRow ankle_out = {"ankle", 22, -2, -5};
  static const MarkerRow ankle_in = {"ankle", -20, 3, 2};
  static const MarkerRow heel = {"ankle", -2, -25, -34};
  static const MarkerRow toe_tip = {"foot", -14, -3, 34};
  static const MarkerRow toe_big = {"foot", -16, 0, 2};
  static const MarkerRow toe_small = {"foot", 22, -5, 6};
  static const MarkerRow acromion = {"collar", 82, 25, -8};
  static const MarkerRow elbow_out = {"elbow", 17, 17, -4};
  static const MarkerRow elbow_in = {"elbow", -14, -14, 0};
  static const MarkerRow wrist_thumb = {"wrist", 0, 0, 18};
  static const MarkerRow wrist_little = {"wrist", 0, 0, -18};
  static const MarkerRow thigh = {"hip", 54, -120, 0};
  static const MarkerRow thigh_front = {"hip", 9, -130, 50};
  static const MarkerRow thigh_back = {"hip", 40, -150, -20};
  static const MarkerRow shank = {"knee", 35, -110, 0};
  static const MarkerRow shank_front = {"knee", 5, -90, 30};
  static const MarkerRow shank_back = {"knee", 25, -120, -25};
  static const MarkerRow finger = {"wrist", 42, -28, 5};
  static const Table table = {
      // Joint centres and keypoints.
      {"hip", hip},
      {"hjc", hip},
      {"knee", knee},
      {"kjc", knee},
      {"ankle", ankle},
      {"ajc", ankle},
      {"shoulder", shoulder},
      {"sjc", shoulder},
      {"elbow", elbow},
      {"ejc", elbow},
      {"wrist", wrist},
      {"wjc", wrist},
      {"bigtoe", {"foot", -14, -2, 28}},
      {"smalltoe", {"foot", 23, -7, 9}},
      {"heel", heel},
      {"eye", {"head", 18, 42, 55}},
      {"ear", {"head", 46, 31, -2}},
      // Plug-in Gait, with medial and cluster markers that laboratories add.
      {"asi", asis},
      {"asis", asis},
      {"psi", psis},
      {"psis", psis},
      {"thi", thigh},
      {"kne", knee_out},
      {"mkne", knee_in},
      {"knm", knee_in},
      {"kneem", knee_in},
      {"tib", shank},
      {"ank", ankle_out},
      {"mank", ankle_in},
      {"anm", ankle_in},
      {"mma", ankle_in},
      {"hee", heel},
      {"toe", {"ankle", 3, -15, 72}},
      {"mt1", toe_big},
      {"mt5", toe_small},
      {"sho", acromion},
      {"upa", {"shoulder", 77, -37, 0}},
      {"elb", elbow_out},
      {"melb", elbow_in},
      {"elbm", elbow_in},
      {"frm", {"elbow", 62, -37, 0}},
      {"fra", {"elbow", 62, -37, 0}},
      {"wra", wrist_thumb},
      {"wrb", wrist_little},
      {"fin", finger},
      {"fhd", {"head", 32, 60, 55}},
      {"bhd", {"head", 32, 60, -50}},
      // CMU: a belt instead of the hip bones, shins.
      {"fwt", asis},
      {"bwt", psis},
      {"shn", shank},
      // OpenSim: gait2392 and Rajagopal.
      {"acromium", acromion},
      {"acromion", acromion},
      {"acr", acromion},
      {"bicep", {"shoulder", 50, -60, 25}},
      {"elbowlat", elbow_out},
      {"elbowmed", elbow_in},
      {"lel", elbow_out},
      {"mel", elbow_in},
      {"wristlat", wrist_thumb},
      {"wristmed", wrist_little},
      {"faradius", wrist_thumb},
      {"faulna", wrist_little},
      {"thighupper", thigh},
      {"thighfront", thigh_front},
      {"thighrear", thigh_back},
      {"th1", thigh},
      {"th2", thigh_front},
      {"th3", thigh_back},
      {"kneelat", knee_out},
      {"kneemed", knee_in},
      {"lfc", knee_out},
      {"mfc", knee_in},
      {"shankupper", shank},
      {"shankfront", shank_front},
      {"shankrear", shank_back},
      {"tb1", shank},
      {"tb2", shank_front},
      {"tb3", shank_back},
      {"anklelat", ankle_out},
      {"anklemed", ankle_in},
      {"lmal", ankle_out},
      {"mmal", ankle_in},
      {"cal", heel},
      {"midfootsup", {"ankle", 3, -5, 50}},
      {"midfootlat", {"ankle", 27, -28, 35}},
      {"toelat", toe_small},
      {"toemed", toe_big},
      {"toetip", toe_tip},
  };
  return table;
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
      const auto found = side_table().find(text.substr(affix.size()));
      if (found != side_table().end()) {
        return placed(found->second, side);
      }
    }
  }
  for (const auto& [word, side] : sides) {
    const std::string affix = word;
    if (text.ends_with(affix)) {
      const auto found = side_table().find(text.substr(0, text.size() - affix.size()));
      if (found != side_table().end()) {
        return placed(found->second, side);
      }
    }
  }
  return std::nullopt;
}

}  // namespace atelier
