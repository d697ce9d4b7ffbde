#include <cctype>
#include <map>

#include "bodymodel/humanoid.h"

namespace atelier {
namespace {

// Names without side, separators and case, and the part that each means. Names that mean
// different joints in different rigs ("shoulder", "leg", "foot", "hand", "hip") get a role of their
// own; find_humanoid settles them by what else there is.
const std::map<std::string, std::string>& role_table() {
  static const std::map<std::string, std::string> table = {
      {"head", "head"},
      {"skull", "head"},
      {"upleg", "upper_leg"},
      {"upperleg", "upper_leg"},
      {"upperleg01", "upper_leg"},
      {"thigh", "upper_leg"},
      {"femur", "upper_leg"},
      {"hip", "hip"},
      {"lowleg", "lower_leg"},
      {"loleg", "lower_leg"},
      {"lowerleg", "lower_leg"},
      {"lowerleg01", "lower_leg"},
      {"shin", "lower_leg"},
      {"calf", "lower_leg"},
      {"tibia", "lower_leg"},
      {"knee", "lower_leg"},
      {"leg", "leg"},
      {"ankle", "ankle"},
      {"talocrural", "ankle"},
      {"foot", "foot"},
      {"toe", "toe"},
      {"toes", "toe"},
      {"toebase", "toe"},
      {"toe0", "toe"},
      {"bigtoe", "toe"},
      {"ball", "toe"},
      {"toe31", "toe"},
      {"collar", "collar"},
      {"clavicle", "collar"},
      {"collarbone", "collar"},
      {"shoulder", "shoulder"},
      {"shldr", "upper_arm"},
      {"uparm", "upper_arm"},
      {"upperarm", "upper_arm"},
      {"upperarm01", "upper_arm"},
      {"arm", "upper_arm"},
      {"humerus", "upper_arm"},
      {"forearm", "lower_arm"},
      {"loarm", "lower_arm"},
      {"lowerarm", "lower_arm"},
      {"lowerarm01", "lower_arm"},
      {"lowarm", "lower_arm"},
      {"elbow", "lower_arm"},
      {"radius", "lower_arm"},
      {"wrist", "wrist"},
      {"hand", "hand"},
  };
  return table;
}

// Finger names by rig; "finger1-1" is MakeHuman's thumb.
std::string finger_role(const std::string& base) {
  static const std::map<std::string, std::string> fingers = {
      {"thumb", "thumb"},   {"index", "index"},    {"middle", "middle"}, {"mid", "middle"},
      {"ring", "ring"},     {"pinky", "little"},   {"little", "little"}, {"finger1", "thumb"},
      {"finger2", "index"}, {"finger3", "middle"}, {"finger4", "ring"},  {"finger5", "little"}};
  std::string name = base;
  if (name.starts_with("hand")) {
    name = name.substr(4);
  }
  if (name.empty() || name.find("metacarpal") != std::string::npos) {
    return "";
  }
  // A trailing "1", "01" or none.
  int knuckle = 1;
  std::string word = name;
  if (name.back() >= '1' && name.back() <= '3' && !fingers.contains(name)) {
    knuckle = name.back() - '0';
    word = name.substr(0, name.size() - 1);
    if (word.size() > 1 && word.back() == '0') {
      word.pop_back();
    }
  } else if (name.starts_with("finger")) {
    return "";
  }
  const auto found = fingers.find(word);
  return found == fingers.end() ? "" : found->second + "_" + std::to_string(knuckle);
}

std::string role_of_base(const std::string& base) {
  const auto found = role_table().find(base);
  return found != role_table().end() ? found->second : finger_role(base);
}

// Words of a name: cut at separators and where a capital follows a small letter; lower case.
std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> words(1);
  char before = 0;
  for (const char c : name) {
    const unsigned char letter = static_cast<unsigned char>(c);
    if (!std::isalnum(letter)) {
      words.emplace_back();
    } else {
      if (std::isupper(letter) && std::islower(static_cast<unsigned char>(before))) {
        words.emplace_back();
      }
      words.back() += static_cast<char>(std::tolower(letter));
    }
    before = c;
  }
  std::erase(words, "");
  return words;
}

}  // namespace

NamedRole role_of_name(const std::string& name) {
  if (name.starts_with("__")) {
    return {};  // helper joints of old MakeHuman rigs stand where their child stands
  }
  std::string plain = name.substr(name.rfind(':') == std::string::npos ? 0 : name.rfind(':') + 1);
  std::vector<std::string> words = words_of(plain);
  std::erase(words, "bip01");
  std::erase(words, "def");
  std::erase(words, "b");  // "b_l_arm" and "c_head" of momentum and MHR: bone, centre
  std::erase(words, "c");
  NamedRole result;
  std::string base;
  for (const std::string& word : words) {
    if (result.side < 0 && (word == "l" || word == "left")) {
      result.side = 0;
    } else if (result.side < 0 && (word == "r" || word == "right")) {
      result.side = 1;
    } else {
      base += word;
    }
  }
  if (result.side < 0) {
    // "lfemur", "LHipJoint" (words: "lhip", "joint"), "leftarm"
    for (const char* prefix : {"left", "right", "l", "r"}) {
      const std::string text = prefix;
      if (base.starts_with(text) && !role_of_base(base.substr(text.size())).empty()) {
        result.side = text[0] == 'l' ? 0 : 1;
        base = base.substr(text.size());
        break;
      }
    }
  }
  result.role = role_of_base(base);
  if (result.role.empty() || (result.side < 0 && result.role != "head")) {
    return {};
  }
  return result;
}

}  // namespace atelier
