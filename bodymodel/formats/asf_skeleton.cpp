#include "bodymodel/formats/asf_skeleton.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>

#include "bodymodel/euler.h"
#include "core/error.h"
#include "core/io/text_scanner.h"

namespace atelier {
namespace {

constexpr double kAsfRadians = std::numbers::pi / 180;

std::string lower(std::string_view word) {
  std::string result(word);
  for (char& c : result) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return result;
}

class AsfReader {
 public:
  AsfReader(std::span<const std::byte> bytes, const std::string& name, const Limits& limits)
      : scanner_(as_text(bytes), name, limits.line_bytes), limits_(limits) {
    result_.radians_per_unit = kAsfRadians;
    result_.bones.push_back({});
    result_.bones[0].name = "root";
  }

  AsfSkeleton read() {
    std::string section;
    while (scanner_.next_line()) {
      const std::string word = lower(scanner_.next_word());
      if (word.empty()) {
        continue;
      }
      if (word[0] == ':') {
        section = word;
        if (section != ":version" && section != ":name" && section != ":units" &&
            section != ":documentation" && section != ":root" && section != ":bonedata" &&
            section != ":hierarchy" && section != ":skin") {
          scanner_.fail("section " + in_quotes(section), "a section of ASF");
        }
      } else if (section == ":units") {
        read_units(word);
      } else if (section == ":root") {
        read_root(word);
      } else if (section == ":bonedata") {
        if (word != "begin") {
          scanner_.fail(in_quotes(word), "begin");
        }
        read_bone();
      } else if (section == ":hierarchy") {
        read_children(word);
      } else if (section.empty()) {
        scanner_.fail(in_quotes(word), "an ASF file, which begins with :version");
      }
    }
    return sorted();
  }

 private:
  void read_units(const std::string& word) {
    if (word == "angle") {
      const std::string unit = lower(scanner_.next_word());
      if (unit != "deg" && unit != "rad" && unit != "degrees" && unit != "radians") {
        scanner_.fail("angle " + in_quotes(unit), "deg or rad");
      }
      result_.radians_per_unit = unit[0] == 'd' ? kAsfRadians : 1;
    }
  }

  std::string order(std::string_view word) {
    std::string letters(word);
    for (char& c : letters) {
      c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
    std::string sorted_letters = letters;
    std::sort(sorted_letters.begin(), sorted_letters.end());
    if (sorted_letters != "XYZ") {
      scanner_.fail("axis order " + in_quotes(word), "the letters X, Y and Z");
    }
    return letters;
  }

  // "axis a b c XYZ": x is turned first, so the matrix is Z Y X.
  Eigen::Matrix3d axes(const Eigen::Vector3d& angles, const std::string& letters) const {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
    for (int i = 0; i < 3; ++i) {
      matrix = axis_rotation(letters[static_cast<std::size_t>(i)] - 'X',
                             result_.radians_per_unit * angles[i]) *
               matrix;
    }
    return matrix;
  }

  Eigen::Vector3d vector(const char* what) {
    Eigen::Vector3d value;
    for (int i = 0; i < 3; ++i) {
      value[i] = scanner_.number(what);
    }
    return value;
  }

  void read_root(const std::string& word) {
    AsfBone& root = result_.bones[0];
    if (word == "order") {
      root.dofs.clear();
      for (std::string_view dof = scanner_.next_word(); !dof.empty(); dof = scanner_.next_word()) {
        root.dofs.push_back(dof_of(dof, true));
      }
    } else if (word == "axis") {
      root.order = order(scanner_.next_word());
    } else if (word == "orientation") {
      root_angles_ = vector("the root's orientation");
    } else if (word == "position") {
      root.direction = vector("the root's position");
      root.length = 1;
    } else {
      scanner_.fail(in_quotes(word), "order, axis, position or orientation");
    }
  }

  char dof_of(std::string_view word, bool root) {
    const std::string dof = lower(word);
    if (dof.size() == 2 && (dof[0] == 'r' || (root && dof[0] == 't')) && dof[1] >= 'x' &&
        dof[1] <= 'z') {
      return dof[0] == 'r' ? static_cast<char>(dof[1] - 'x' + 'X') : dof[1];
    }
    scanner_.fail("degree of freedom " + in_quotes(word),
                  root ? "tx, ty, tz, rx, ry or rz" : "rx, ry or rz");
  }

  void read_bone() {
    if (static_cast<std::int64_t>(result_.bones.size()) >= limits_.joints) {
      scanner_.fail("more bones", "at most " + std::to_string(limits_.joints));
    }
    AsfBone bone;
    bone.length = -1;
    bool has_axis = false;
    for (;;) {
      if (!scanner_.next_line()) {
        scanner_.fail("the end of the file in bone " + in_quotes(bone.name), "end");
      }
      const std::string word = lower(scanner_.next_word());
      if (word == "end") {
        break;
      }
      if (word == "name") {
        bone.name = scanner_.next_word();
      } else if (word == "direction") {
        bone.direction = vector("the direction");
      } else if (word == "length") {
        bone.length = scanner_.number("the length");
      } else if (word == "axis") {
        const Eigen::Vector3d angles = vector("the axis");
        bone.order = order(scanner_.next_word());
        bone.axis = axes(angles, bone.order);
        has_axis = true;
      } else if (word == "dof") {
        for (std::string_view dof = scanner_.next_word(); !dof.empty();
             dof = scanner_.next_word()) {
          if (bone.dofs.size() == 3) {
            scanner_.fail("more than three degrees of freedom", "rx, ry, rz");
          }
          bone.dofs.push_back(dof_of(dof, false));
        }
      } else if (!word.empty() && word != "id" && word != "limits" && word[0] != '(' &&
                 word != "bodymass" && word != "cofmass") {
        scanner_.fail(in_quotes(word), "a field of a bone");
      }
    }
    if (bone.name.empty() || !(bone.length >= 0) || !has_axis ||
        !(std::abs(bone.direction.norm() - 1) < 0.01)) {
      scanner_.fail("bone " + in_quotes(bone.name) + " without all of its fields",
                    "name, unit direction, length and axis");
    }
    if (index_of(bone.name) >= 0) {
      scanner_.fail("bone " + in_quotes(bone.name) + " twice", "each name once");
    }
    names_[bone.name] = static_cast<int>(result_.bones.size());
    result_.bones.push_back(std::move(bone));
  }

  int index_of(const std::string& name) const {
    if (name == "root") {
      return 0;
    }
    const auto found = names_.find(name);
    return found == names_.end() ? -1 : found->second;
  }

  void read_children(const std::string& first) {
    if (first == "begin" || first == "end") {
      return;
    }
    // Names keep their case; `first` was lowered, so find it by that.
    int parent = index_of(first);
    for (const auto& [name, index] : names_) {
      if (parent < 0 && lower(name) == first) {
        parent = index;
      }
    }
    if (parent < 0) {
      scanner_.fail("bone " + in_quotes(first), "a bone of :bonedata");
    }
    for (std::string_view word = scanner_.next_word(); !word.empty(); word = scanner_.next_word()) {
      const int child = index_of(std::string(word));
      if (child < 1) {
        scanner_.fail("bone " + in_quotes(word), "a bone of :bonedata");
      }
      AsfBone& bone = result_.bones[static_cast<std::size_t>(child)];
      if (bone.parent >= 0) {
        scanner_.fail("bone " + in_quotes(word) + " with two parents", "a tree");
      }
      bone.parent = parent;
    }
  }

  // Parents before children, whatever the file's order.
  AsfSkeleton sorted() {
    if (result_.bones.size() < 2) {
      scanner_.fail("no bones", ":bonedata with bones");
    }
    result_.bones[0].axis = axes(root_angles_, result_.bones[0].order);
    AsfSkeleton tree;
    tree.radians_per_unit = result_.radians_per_unit;
    std::vector<int> number(result_.bones.size(), -1);
    tree.bones.push_back(result_.bones[0]);
    number[0] = 0;
    for (bool more = true; more;) {
      more = false;
      for (std::size_t b = 1; b < result_.bones.size(); ++b) {
        const int parent = result_.bones[b].parent;
        if (number[b] < 0 && parent >= 0 && number[static_cast<std::size_t>(parent)] >= 0) {
          number[b] = static_cast<int>(tree.bones.size());
          tree.bones.push_back(result_.bones[b]);
          tree.bones.back().parent = number[static_cast<std::size_t>(parent)];
          more = true;
        }
      }
    }
    for (std::size_t b = 1; b < number.size(); ++b) {
      if (number[b] < 0) {
        scanner_.fail("bone " + in_quotes(result_.bones[b].name) + " does not hang on the root",
                      "a tree in :hierarchy");
      }
    }
    return tree;
  }

  TextScanner scanner_;
  const Limits& limits_;
  AsfSkeleton result_;
  std::map<std::string, int> names_;
  Eigen::Vector3d root_angles_ = Eigen::Vector3d::Zero();
};

}  // namespace

AsfSkeleton read_asf(std::span<const std::byte> bytes, const std::string& name,
                     const Limits& limits) {
  return AsfReader(bytes, name, limits).read();
}

}  // namespace atelier
