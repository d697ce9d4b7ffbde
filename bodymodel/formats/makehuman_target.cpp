#include "bodymodel/formats/makehuman_target.h"

#include <cmath>
#include <map>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/text_scanner.h"

namespace atelier {
namespace {

struct Anchor {
  const char* name;
  double weight;
};

std::vector<Anchor> three_anchors(double slider, const char* low, const char* middle,
                                  const char* high) {
  const double below = std::max(0.0, 1 - 2 * slider);
  const double above = std::max(0.0, 2 * slider - 1);
  return {{low, below}, {middle, 1 - below - above}, {high, above}};
}

std::vector<Anchor> age_anchors(double age) {
  constexpr double kChild = 0.1875;
  if (age < kChild) {
    return {{"baby", 1 - age / kChild}, {"child", age / kChild}};
  }
  if (age < 0.5) {
    const double young = (age - kChild) / (0.5 - kChild);
    return {{"child", 1 - young}, {"young", young}};
  }
  return {{"young", 2 - 2 * age}, {"old", 2 * age - 1}};
}

void check_macros(const MakeHumanMacros& m) {
  for (const double slider : {m.gender, m.age, m.muscle, m.weight, m.height, m.proportions,
                              m.african, m.asian, m.caucasian}) {
    ATELIER_CHECK(slider >= 0 && slider <= 1, "a macro slider is not in [0, 1]");
  }
  ATELIER_CHECK(std::abs(m.african + m.asian + m.caucasian - 1) < 1e-6,
                "african, asian and caucasian must share 1");
}

}  // namespace

OptionTable describe(MakeHumanMacros& macros) {
  OptionTable table;
  table.add("gender", macros.gender, 0, 1, "", "MakeHuman's gender slider: 0 female, 1 male");
  table.add("age", macros.age, 0, 1, "",
            "MakeHuman's age slider: 0 baby, 0.1875 child, 0.5 young adult, 1 old");
  table.add("muscle", macros.muscle, 0, 1, "", "MakeHuman's muscle slider; 0.5: average");
  table.add("weight", macros.weight, 0, 1, "", "MakeHuman's weight slider; 0.5: average");
  table.add("height", macros.height, 0, 1, "", "MakeHuman's height slider; 0.5: average");
  table.add("proportions", macros.proportions, 0, 1, "",
            "MakeHuman's proportions slider: 0 uncommon, 1 ideal");
  table.add("african", macros.african, 0, 1, "",
            "Share of MakeHuman's African features; the three shares add up to 1");
  table.add("asian", macros.asian, 0, 1, "",
            "Share of MakeHuman's Asian features; the three shares add up to 1");
  table.add("caucasian", macros.caucasian, 0, 1, "",
            "Share of MakeHuman's Caucasian features; the three shares add up to 1");
  return table;
}

Blendshape read_target(std::span<const std::byte> bytes, const std::string& name,
                       Index base_vertices, const Limits& limits) {
  TextScanner scanner(as_text(bytes), name, limits.line_bytes);
  std::map<int, Eigen::Vector3d> moved;
  while (scanner.next_line()) {
    const std::string_view word = scanner.next_word();
    if (word.empty()) {
      continue;
    }
    std::int64_t vertex = -1;
    if (!parse_integer(word, vertex) || vertex < 0 || vertex >= base_vertices) {
      scanner.fail(in_quotes(word), "a vertex in [0, " + std::to_string(base_vertices) + ")");
    }
    Eigen::Vector3d offset;
    for (int i = 0; i < 3; ++i) {
      offset[i] = scanner.number("an offset");
    }
    if (!scanner.next_word().empty()) {
      scanner.fail("more than four words", "a vertex and three offsets");
    }
    const auto [entry, added] = moved.emplace(static_cast<int>(vertex), offset);
    if (!added) {
      entry->second += offset;
    }
  }
  Blendshape shape;
  shape.offsets.resize(static_cast<Index>(moved.size()), 3);
  for (const auto& [vertex, offset] : moved) {
    shape.offsets.row(static_cast<Index>(shape.vertices.size())) = kMetresPerMakeHumanUnit * offset;
    shape.vertices.push_back(vertex);
  }
  return shape;
}

Blendshape read_target(const std::filesystem::path& path, Index base_vertices,
                       const Limits& limits) {
  return read_target(read_file_bytes(path, limits.mesh_file_bytes), path.string(), base_vertices,
                     limits);
}

std::vector<MacroTarget> macro_targets(const MakeHumanMacros& m) {
  check_macros(m);
  const std::vector<Anchor> genders = {{"female", 1 - m.gender}, {"male", m.gender}};
  const std::vector<Anchor> ages = age_anchors(m.age);
  const std::vector<Anchor> muscles =
      three_anchors(m.muscle, "minmuscle", "averagemuscle", "maxmuscle");
  const std::vector<Anchor> weights =
      three_anchors(m.weight, "minweight", "averageweight", "maxweight");
  const std::vector<Anchor> heights = three_anchors(m.height, "minheight", "", "maxheight");
  const std::vector<Anchor> proportions =
      three_anchors(m.proportions, "uncommonproportions", "", "idealproportions");
  const std::vector<Anchor> races = {
      {"african", m.african}, {"asian", m.asian}, {"caucasian", m.caucasian}};

  std::vector<MacroTarget> targets;
  const auto add = [&](const std::string& name, double weight) {
    if (weight > 0) {
      targets.push_back({name, weight});
    }
  };
  for (const Anchor& gender : genders) {
    for (const Anchor& age : ages) {
      const std::string person = std::string(gender.name) + "-" + age.name;
      const double share = gender.weight * age.weight;
      for (const Anchor& race : races) {
        add(race.name + ("-" + person), share * race.weight);
      }
      for (const Anchor& muscle : muscles) {
        for (const Anchor& weight : weights) {
          const std::string build = person + "-" + muscle.name + "-" + weight.name;
          const double factor = share * muscle.weight * weight.weight;
          add("universal-" + build, factor);
          for (const Anchor& height : heights) {
            if (height.name[0] != '\0') {
              add("height/" + build + "-" + height.name, factor * height.weight);
            }
          }
          for (const Anchor& proportion : proportions) {
            if (proportion.name[0] != '\0') {
              add("proportions/" + build + "-" + proportion.name, factor * proportion.weight);
            }
          }
        }
      }
    }
  }
  return targets;
}

}  // namespace atelier
