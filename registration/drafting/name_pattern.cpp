#include "registration/drafting/name_pattern.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "core/error.h"
#include "core/topology.h"

namespace atelier {
namespace {

/// Places as the wearer has them: left of the middle, up from the lowest, ahead. Metres.
struct WearerFrame {
  Eigen::Vector3d left, ahead;
  double middle = 0, low = 0, height = 0, half_width = 0;

  double leftness(const Eigen::Vector3d& at) const { return at.dot(left) - middle; }
  double share_of_height(const Eigen::Vector3d& at) const {
    return (at.y() - low) / std::max(height, 1e-9);
  }
  /// "left", "right" or "" in the middle.
  std::string side(const Eigen::Vector3d& at) const {
    constexpr double kMiddle = 0.1;  // of half the width
    const double off = leftness(at);
    return off > kMiddle * half_width ? "left" : off < -kMiddle * half_width ? "right" : "";
  }
};

WearerFrame wearer_frame(const Mesh& mesh, const Eigen::Vector3d& facing) {
  WearerFrame frame;
  frame.ahead = facing;
  frame.left = Eigen::Vector3d::UnitY().cross(facing);
  frame.low = mesh.vertices.col(1).minCoeff();
  frame.height = mesh.vertices.col(1).maxCoeff() - frame.low;
  const Eigen::VectorXd across = mesh.vertices * frame.left;
  frame.middle = (across.minCoeff() + across.maxCoeff()) / 2;
  frame.half_width = (across.maxCoeff() - across.minCoeff()) / 2;
  return frame;
}

std::string joined(const std::string& word, const std::string& more) {
  return more.empty() ? word : word + " " + more;
}

struct Opening {
  std::vector<int> loop;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double low = 0, high = 0, length = 0;
};

std::vector<Opening> openings_of(const Mesh& mesh) {
  std::vector<Opening> openings;
  for (std::vector<int>& loop : boundary_loops(topology_of(mesh.faces, mesh.vertices.rows()))) {
    Opening opening;
    opening.low = opening.high = mesh.vertices(loop.front(), 1);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector3d a = mesh.vertices.row(loop[i]);
      const Eigen::Vector3d b = mesh.vertices.row(loop[(i + 1) % loop.size()]);
      opening.middle += (b - a).norm() * (a + b) / 2;
      opening.length += (b - a).norm();
      opening.low = std::min(opening.low, a.y());
      opening.high = std::max(opening.high, a.y());
    }
    opening.middle /= std::max(opening.length, 1e-12);
    opening.loop = std::move(loop);
    openings.push_back(std::move(opening));
  }
  return openings;
}

/// Whether another opening lies about as high and as far to the other side.
bool has_twin(const std::vector<Opening>& openings, std::size_t one, const WearerFrame& frame) {
  const double off = frame.leftness(openings[one].middle);
  return std::any_of(openings.begin(), openings.end(), [&](const Opening& other) {
    return &other != &openings[one] &&
           std::abs(frame.leftness(other.middle) + off) < 0.4 * std::abs(off) &&
           std::abs(other.middle.y() - openings[one].middle.y()) < 0.2 * frame.height;
  });
}

std::vector<std::string> opening_words(const std::vector<Opening>& openings,
                                       const WearerFrame& frame) {
  constexpr double kBeside = 0.2;  // of half the width
  constexpr double kTall = 0.6;    // of the garment: a front that is open
  std::vector<std::string> words(openings.size());
  std::vector<std::size_t> central;
  for (std::size_t i = 0; i < openings.size(); ++i) {
    const bool beside = std::abs(frame.leftness(openings[i].middle)) > kBeside * frame.half_width;
    if (beside && has_twin(openings, i, frame)) {
      words[i] = "pair";
    } else if (openings[i].high - openings[i].low > kTall * frame.height) {
      words[i] = "edge";
    } else if (!beside) {
      central.push_back(i);
    }
  }
  const auto higher = [&](std::size_t a, std::size_t b) {
    return openings[a].middle.y() > openings[b].middle.y();
  };
  std::sort(central.begin(), central.end(), higher);
  double lowest = frame.low + frame.height;
  for (const std::size_t i : central) {
    lowest = std::min(lowest, openings[i].middle.y());
  }
  bool arms = false;
  for (std::size_t i = 0; i < openings.size(); ++i) {
    if (words[i] == "pair") {
      const bool leg =
          openings[i].middle.y() < lowest && frame.share_of_height(openings[i].middle) < 0.3;
      arms = arms || !leg;
      words[i] = joined(leg ? "hem" : "cuff", frame.side(openings[i].middle));
    }
  }
  for (std::size_t k = 0; k < central.size(); ++k) {
    const bool top = k == 0 && frame.share_of_height(openings[central[k]].middle) > 0.5;
    const bool bottom = k + 1 == central.size() && !top;
    words[central[k]] = top ? (arms ? "neck" : "waist") : bottom ? "hem" : "";
  }
  int number = 0;
  for (std::string& word : words) {
    ++number;
    if (word.empty()) {
      word = "opening " + std::to_string(number);
    }
  }
  return words;
}

/// What is known of a panel on the body.
struct PanelFacts {
  double area = 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  double low = 1e18, high = -1e18;
  std::set<std::string> borders;  ///< openings, without left and right
  std::set<std::string> cuffs;

  bool touches(const char* word) const { return borders.count(word) != 0; }
};

std::vector<PanelFacts> facts_of_panels(const FlatPattern& pattern, const PatternNames& names,
                                        const Mesh& mesh) {
  std::vector<PanelFacts> facts(static_cast<std::size_t>(pattern.cut.panel_count));
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    PanelFacts& panel =
        facts[static_cast<std::size_t>(pattern.cut.panels[static_cast<std::size_t>(f)])];
    const Eigen::Vector3d a = mesh.vertices.row(mesh.faces(f, 0));
    const Eigen::Vector3d b = mesh.vertices.row(mesh.faces(f, 1));
    const Eigen::Vector3d c = mesh.vertices.row(mesh.faces(f, 2));
    const Eigen::Vector3d normal = (b - a).cross(c - a) / 2;
    panel.area += normal.norm();
    panel.normal += normal;
    panel.middle += normal.norm() * (a + b + c) / 3;
    for (int k = 0; k < 3; ++k) {
      const double y = mesh.vertices(mesh.faces(f, k), 1);
      panel.low = std::min(panel.low, y);
      panel.high = std::max(panel.high, y);
      const int opening = names.opening_at[static_cast<std::size_t>(pattern.cut.faces(f, k))];
      if (opening >= 0) {
        const std::string& name = names.openings[static_cast<std::size_t>(opening)];
        panel.borders.insert(name.substr(0, name.find(' ')));
        if (name.starts_with("cuff")) {
          panel.cuffs.insert(name);
        }
      }
    }
  }
  for (PanelFacts& panel : facts) {
    panel.middle /= std::max(panel.area, 1e-12);
    panel.normal /= std::max(panel.area, 1e-12);
  }
  return facts;
}

std::string panel_word(const PanelFacts& panel, const WearerFrame& frame) {
  constexpr double kBand = 0.09;  // m
  constexpr double kFlat = 0.35;  // of the area, that looks one way: less goes round
  const bool band = panel.high - panel.low < kBand;
  if (panel.cuffs.size() == 1 && !panel.touches("hem") && !panel.touches("waist")) {
    return joined(band && !panel.touches("neck") && panel.area < 0.03 ? "cuff" : "sleeve",
                  frame.side(panel.middle));
  }
  if (band && panel.touches("neck")) {
    return "collar";
  }
  if (band && panel.touches("waist")) {
    return "waistband";
  }
  if (panel.cuffs.size() > 1 && !panel.touches("hem") && !panel.touches("waist")) {
    return panel.normal.dot(frame.ahead) > 0 ? "front yoke" : "back yoke";
  }
  Eigen::Vector3d level = panel.normal;
  level.y() = 0;
  if (level.norm() < kFlat && panel.normal.norm() < kFlat) {
    return "body";
  }
  const double ahead = level.dot(frame.ahead);
  return std::abs(ahead) < 0.5 * level.norm() ? joined("side", frame.side(panel.middle))
         : ahead > 0                          ? "front"
                                              : "back";
}

/// Numbers what is called alike.
void make_unique_names(std::vector<std::string>& names) {
  std::map<std::string, int> total;
  for (const std::string& name : names) {
    ++total[name];
  }
  std::map<std::string, int> so_far;
  for (std::string& name : names) {
    if (total[name] > 1) {
      name += " " + std::to_string(++so_far[name]);
    }
  }
}

/// Tells panels of one word apart: by side, by height, by numbers.
void tell_apart(std::vector<std::string>& names, const std::vector<PanelFacts>& facts,
                const WearerFrame& frame) {
  using Word = std::string (*)(const PanelFacts&, const PanelFacts&, const WearerFrame&);
  const Word by_side = [](const PanelFacts& panel, const PanelFacts& /*all*/,
                          const WearerFrame& where) { return where.side(panel.middle); };
  const Word by_height = [](const PanelFacts& panel, const PanelFacts& all,
                            const WearerFrame& where) -> std::string {
    const double off = panel.middle.y() - all.middle.y();
    return off > 0.05 * where.height ? "upper" : off < -0.05 * where.height ? "lower" : "";
  };
  for (const Word word : {by_side, by_height}) {
    std::map<std::string, std::vector<std::size_t>> alike;
    for (std::size_t p = 0; p < names.size(); ++p) {
      alike[names[p]].push_back(p);
    }
    for (const auto& [name, panels] : alike) {
      PanelFacts all;
      for (const std::size_t p : panels) {
        all.middle += facts[p].middle / static_cast<double>(panels.size());
      }
      for (const std::size_t p : panels) {
        const bool told = name.ends_with(" left") || name.ends_with(" right");
        if (panels.size() > 1 && !(told && word == by_side)) {
          names[p] = joined(name, word(facts[p], all, frame));
        }
      }
    }
  }
  make_unique_names(names);
}

/// Whether both sides of a seam end in one point of one panel.
bool is_dart(const FlatSeam& seam) {
  return seam.panel_a == seam.panel_b &&
         (seam.a.back() == seam.b.back() || seam.a.front() == seam.b.front());
}

std::string first_word(const std::string& name) {
  return name.substr(0, name.find(' '));
}

struct SeamFacts {
  Eigen::Vector3d middle, along;
  bool at_neck = false;
};

SeamFacts facts_of_seam(const FlatSeam& seam, const FlatPattern& pattern, const PatternNames& names,
                        const Mesh& mesh) {
  const auto at = [&](int v) {
    return Eigen::Vector3d(mesh.vertices.row(pattern.cut.source[static_cast<std::size_t>(v)]));
  };
  SeamFacts facts;
  facts.middle.setZero();
  for (const int v : seam.a) {
    facts.middle += at(v) / static_cast<double>(seam.a.size());
  }
  facts.along = at(seam.a.back()) - at(seam.a.front());
  for (const int v : {seam.a.front(), seam.a.back()}) {
    const int opening = names.opening_at[static_cast<std::size_t>(v)];
    facts.at_neck = facts.at_neck ||
                    (opening >= 0 && names.openings[static_cast<std::size_t>(opening)] == "neck");
  }
  return facts;
}

std::string seam_word(const FlatSeam& seam, const PatternNames& names, const SeamFacts& facts,
                      const WearerFrame& frame) {
  const std::string& name_a = names.panels[static_cast<std::size_t>(seam.panel_a)];
  const std::string& name_b = names.panels[static_cast<std::size_t>(seam.panel_b)];
  std::array<std::string, 2> words{first_word(name_a), first_word(name_b)};
  std::sort(words.begin(), words.end());
  const std::string side = frame.side(facts.middle);
  const auto either = [&](const char* word) { return words[0] == word || words[1] == word; };
  if (is_dart(seam)) {
    return joined("dart", name_a);
  }
  if (seam.panel_a == seam.panel_b) {
    return words[0] == "sleeve" ? joined("underarm", side) : joined("seam", name_a);
  }
  if (words[0] == words[1]) {
    const bool lengthwise = std::abs(facts.along.y()) > 0.5 * facts.along.norm();
    if (words[0] == "sleeve") {
      return joined("underarm", side);
    }
    if (words[0] == "collar" || words[0] == "waistband" || words[0] == "cuff") {
      return joined(words[0], side);
    }
    return !lengthwise ? joined(words[0], "waist")
                       : joined(words[0], side.empty() ? "centre" : side);
  }
  if (either("collar")) {
    return joined("neck", words[0] == "collar" ? words[1] : words[0]);
  }
  if (either("waistband")) {
    return joined("waist", words[0] == "waistband" ? words[1] : words[0]);
  }
  if (either("cuff")) {
    return joined("cuff", side);
  }
  if (either("sleeve")) {
    return joined("armhole " + (words[0] == "sleeve" ? words[1] : words[0]), side);
  }
  if (words[0] == "back" && words[1] == "front") {
    const bool crosswise = std::abs(facts.along.y()) < 0.7 * facts.along.norm();
    constexpr double kShoulders = 0.75;  // of the garment's height
    const bool high = frame.share_of_height(facts.middle) > kShoulders;
    if (crosswise && (facts.at_neck || high)) {
      return joined("shoulder", side);
    }
    const bool legs = std::any_of(
        names.openings.begin(), names.openings.end(),
        [](const std::string& name) { return name == "hem left" || name == "hem right"; });
    const bool inside = std::abs(frame.leftness(facts.middle)) < 0.45 * frame.half_width;
    return joined(legs && inside ? "inseam" : "side", side);
  }
  return joined(words[0] + "-" + words[1], side);
}

}  // namespace

PatternNames name_pattern(const FlatPattern& pattern, const Mesh& mesh,
                          const Eigen::Vector3d& facing) {
  ATELIER_CHECK(std::abs(facing.norm() - 1) < 1e-6, "a unit vector");
  ATELIER_CHECK(pattern.cut.faces.rows() == mesh.faces.rows(), "the pattern of this mesh");
  const WearerFrame frame = wearer_frame(mesh, facing);
  const std::vector<Opening> openings = openings_of(mesh);
  PatternNames names;
  names.openings = opening_words(openings, frame);
  make_unique_names(names.openings);
  std::vector<int> opening_at(static_cast<std::size_t>(mesh.vertices.rows()), -1);
  for (std::size_t i = 0; i < openings.size(); ++i) {
    for (const int v : openings[i].loop) {
      opening_at[static_cast<std::size_t>(v)] = static_cast<int>(i);
    }
  }
  for (const int v : pattern.cut.source) {
    names.opening_at.push_back(opening_at[static_cast<std::size_t>(v)]);
  }
  const std::vector<PanelFacts> facts = facts_of_panels(pattern, names, mesh);
  for (const PanelFacts& panel : facts) {
    names.panels.push_back(panel_word(panel, frame));
  }
  tell_apart(names.panels, facts, frame);
  for (const FlatSeam& seam : pattern.seams) {
    names.seams.push_back(seam_word(seam, names, facts_of_seam(seam, pattern, names, mesh), frame));
  }
  make_unique_names(names.seams);
  return names;
}

SewingPattern in_craft_order(const SewingPattern& pattern) {
  constexpr std::array kOrder = {"front", "back", "side", "sleeve", "collar", "waistband", "cuff"};
  const auto rank = [&](int panel) {
    const std::string& name = pattern.panels[static_cast<std::size_t>(panel)].name;
    const auto word = std::find(kOrder.begin(), kOrder.end(), first_word(name));
    return std::pair(word - kOrder.begin(), name);
  };
  std::vector<int> order(pattern.panels.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return rank(a) < rank(b); });
  std::vector<int> place(order.size());
  SewingPattern sorted;
  sorted.name = pattern.name;
  for (const int panel : order) {
    place[static_cast<std::size_t>(panel)] = static_cast<int>(sorted.panels.size());
    sorted.panels.push_back(pattern.panels[static_cast<std::size_t>(panel)]);
  }
  sorted.seams = pattern.seams;
  for (SewnEdges& seam : sorted.seams) {
    seam.panel_a = place[static_cast<std::size_t>(seam.panel_a)];
    seam.panel_b = place[static_cast<std::size_t>(seam.panel_b)];
  }
  return sorted;
}

}  // namespace atelier
