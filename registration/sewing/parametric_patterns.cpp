#include "registration/sewing/parametric_patterns.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;
constexpr double kOverRidge = 0.02;  // m that panels begin above the shoulders

// Corners of a bodice panel, and so its edges; `left` and `right` as seen from outside.
enum BodiceEdge {
  BodiceHem,
  SideRight,
  ArmholeRight,
  ShoulderRight,
  Neck,
  ShoulderLeft,
  ArmholeLeft,
  SideLeft
};
enum SleeveEdge { Cuff, SleeveRight, CapRight, CapLeft, SleeveLeft };
enum SkirtEdge { SkirtHem, SkirtRight, SkirtWaist, SkirtLeft };
// Of a leg whose outer side is +x; a mirrored leg has the edges in reverse order.
enum LegEdge { LegHem, Outseam, LegWaist, CenterSeam, Inseam };
constexpr int kLegEdges = 5;
int mirrored(LegEdge edge) {
  return kLegEdges - 1 - edge;
}

Points2 rows(std::initializer_list<Vector2> points) {
  Points2 out(static_cast<Index>(points.size()), 2);
  Index i = 0;
  for (const Vector2& point : points) {
    out.row(i++) = point.transpose();
  }
  return out;
}

std::vector<PanelEdge> loop_of_edges(int count) {
  std::vector<PanelEdge> edges;
  edges.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    edges.push_back({i, (i + 1) % count, {}, ""});
  }
  return edges;
}

Vector3 rotation_vector(const Vector3& x, const Vector3& y, const Vector3& z) {
  Eigen::Matrix3d matrix;
  matrix << x, y, z;
  const Eigen::AngleAxisd rotation(matrix);
  return rotation.angle() * rotation.axis();
}

// Faces front (+Z) or back (-Z), bent round a vertical axis through `axis`; the panel's (0, 0) is
// at the height of `axis`.
PanelPlacement round_body(const Vector3& axis, double radius, bool front) {
  PanelPlacement placement;
  placement.bend_radius = radius;
  placement.origin = axis + Vector3(0, 0, front ? radius : -radius);
  placement.rotation = Vector3(0, front ? 0 : kPi, 0);
  return placement;
}

struct Block {
  double half_chest;  // of the panel
  double half_hem;
  double half_shoulder;
  double half_neck;
  double underarm;  // heights over the hem
  double shoulder;
  double top;
};

Block draft_block(const TailorMeasures& m, const TeeOptions& options, double half_hem) {
  Block block{};
  block.half_chest = (m.chest_girth + options.ease) / 4;
  block.half_hem = half_hem;
  block.half_shoulder = m.shoulder_width / 2;
  block.half_neck = m.neckline > 0 ? m.neckline : m.neck_girth / 6 + 0.015;
  block.top = m.back_length + options.length;
  block.shoulder = block.top - 0.045;                            // slope of an average shoulder
  block.underarm = block.shoulder - (m.chest_girth / 8 + 0.07);  // armhole depth
  ATELIER_CHECK(block.half_chest > 0.05 && block.half_hem > 0.05, "a bodice without width");
  ATELIER_CHECK(block.half_shoulder > block.half_neck + 0.02, "shoulders narrower than the neck");
  ATELIER_CHECK(block.half_chest > block.half_shoulder - 0.08,
                "a chest much narrower than the shoulders");
  ATELIER_CHECK(block.underarm > 0.02, "a bodice shorter than its armholes");
  return block;
}

Panel bodice_panel(const std::string& name, const Block& b, double neck_depth) {
  Panel panel;
  panel.name = name;
  panel.corners = rows({{-b.half_hem, 0},
                        {b.half_hem, 0},
                        {b.half_chest, b.underarm},
                        {b.half_shoulder, b.shoulder},
                        {b.half_neck, b.top},
                        {-b.half_neck, b.top},
                        {-b.half_shoulder, b.shoulder},
                        {-b.half_chest, b.underarm}});
  panel.edges = loop_of_edges(8);
  const double depth = b.shoulder - b.underarm;
  const double inner = std::min(b.half_shoulder, b.half_chest) - 0.02;
  // Out from the underarm level, then straight up to the shoulder.
  panel.edges[ArmholeRight].controls = {{inner, b.underarm + 0.08 * depth},
                                        {inner, b.underarm + 0.5 * depth}};
  panel.edges[ArmholeLeft].controls = {{-inner, b.underarm + 0.5 * depth},
                                       {-inner, b.underarm + 0.08 * depth}};
  // A cubic whose inner controls lie 4/3 deep reaches the depth in the middle.
  const double control_y = b.top - neck_depth * 4 / 3;
  panel.edges[Neck].controls = {{0.8 * b.half_neck, control_y}, {-0.8 * b.half_neck, control_y}};
  panel.edges[Neck].name = "neck";
  return panel;
}

Panel sleeve_panel(const std::string& name, double half_width, double half_cuff, double length,
                   double cap_height) {
  Panel panel;
  panel.name = name;
  const double top = length + cap_height;
  panel.corners = rows(
      {{-half_cuff, 0}, {half_cuff, 0}, {half_width, length}, {0, top}, {-half_width, length}});
  panel.edges = loop_of_edges(5);
  panel.edges[CapRight].controls = {{0.6 * half_width, length + 0.05 * cap_height},
                                    {0.5 * half_width, top}};
  panel.edges[CapLeft].controls = {{-0.5 * half_width, top},
                                   {-0.6 * half_width, length + 0.05 * cap_height}};
  return panel;
}

// The cap's height at which one half of the cap is as long as the mean of both armholes.
double cap_height(double half_width, double armhole) {
  const auto length = [&](double height) {
    return edge_length(sleeve_panel("cap", half_width, half_width, 0.1, height), CapRight);
  };
  double low = 1e-3;
  double high = armhole;
  if (length(low) > armhole) {
    return low;  // a sleeve wider than the armhole: the cap is eased in
  }
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (length(middle) < armhole ? low : high) = middle;
  }
  return (low + high) / 2;
}

PanelPlacement round_arm(const Vector3& shoulder, const Vector3& wrist, double half_width,
                         double length) {
  const Vector3 up = (shoulder - wrist).normalized();
  Vector3 outside = Vector3(shoulder.x() > 0 ? 1 : -1, 1, 0);
  outside = (outside - outside.dot(up) * up).normalized();
  PanelPlacement placement;
  placement.bend_radius = 1.1 * 2 * half_width / (2 * kPi);
  placement.rotation = rotation_vector(up.cross(outside), up, outside);
  // The underarm level lies a little below the shoulder point.
  placement.origin = shoulder - (length + 0.06) * up + placement.bend_radius * outside;
  return placement;
}

int add_panel(SewingPattern& pattern, Panel panel) {
  pattern.panels.push_back(std::move(panel));
  return static_cast<int>(pattern.panels.size()) - 1;
}

struct Bodice {
  int front, back;
};

// Front, back and sleeves, sewn, with the hem at the height `hem` of the world.
Bodice add_bodice(SewingPattern& pattern, const TailorMeasures& m, const TeeOptions& options,
                  double half_hem, double hem) {
  const Block block = draft_block(m, options, half_hem);
  Panel front = bodice_panel("front", block, options.neck_depth);
  Panel back = bodice_panel("back", block, 0.025);
  // Shoulder seams close over the shoulders: where these rise higher than the bodice is long, its
  // panels begin above them, or their threads would pull them against chest and back.
  const double lift = m.ridge > 0 ? std::max(0.0, m.ridge + kOverRidge - (hem + block.top)) : 0;
  const Vector3 axis(m.neck_base.x(), hem + lift, m.waist.z());
  const double radius =
      std::max(1.1 * 4 * block.half_chest / (2 * kPi), m.shoulder_width / 2 + 0.03);
  front.placement = round_body(axis, radius, true);
  back.placement = round_body(axis, radius, false);
  const double armhole = (edge_length(front, ArmholeRight) + edge_length(back, ArmholeRight)) / 2;
  const Bodice bodice{add_panel(pattern, front), add_panel(pattern, back)};
  pattern.seams.push_back({"left side", bodice.front, SideRight, bodice.back, SideLeft});
  pattern.seams.push_back({"right side", bodice.front, SideLeft, bodice.back, SideRight});
  pattern.seams.push_back(
      {"left shoulder", bodice.front, ShoulderRight, bodice.back, ShoulderLeft});
  pattern.seams.push_back(
      {"right shoulder", bodice.front, ShoulderLeft, bodice.back, ShoulderRight});

  const double half_width = (m.upper_arm_girth + options.sleeve_ease) / 2;
  const double length = options.sleeve * m.arm_length;
  ATELIER_CHECK(length > 0.02, "a sleeve without length");
  const double height = cap_height(half_width, armhole);
  const double half_cuff = half_width * (1 - 0.25 * options.sleeve);
  for (const bool left : {true, false}) {
    const std::string side = left ? "left" : "right";
    Panel sleeve = sleeve_panel(side + " sleeve", half_width, half_cuff, length, height);
    sleeve.edges[Cuff].name = side + " cuff";
    sleeve.placement = left ? round_arm(m.left_shoulder, m.left_wrist, half_width, length)
                            : round_arm(m.right_shoulder, m.right_wrist, half_width, length);
    const int index = add_panel(pattern, sleeve);
    pattern.seams.push_back({side + " sleeve", index, SleeveRight, index, SleeveLeft});
    // On the left arm the sleeve's +x side is behind, on the right arm in front.
    pattern.seams.push_back(
        {side + " armhole right", index, CapRight, left ? bodice.back : bodice.front, ArmholeLeft});
    pattern.seams.push_back(
        {side + " armhole left", index, CapLeft, left ? bodice.front : bodice.back, ArmholeRight});
  }
  return bodice;
}

// A sector of a ring: the waist arc has length `waist`, the hem lies `length` further out.
Panel skirt_panel(const std::string& name, double waist, double length, double angle) {
  const double inner = waist / angle;
  const double outer = inner + length;
  const auto at = [&](double phi, double radius) {
    return Vector2(radius * std::sin(phi), outer - radius * std::cos(phi));
  };
  const double half = angle / 2;
  const double reach = 4.0 / 3 * std::tan(angle / 4);   // cubic Bezier of a circular arc
  const Vector2 right(std::cos(half), std::sin(half));  // tangent at +half, outward to the right
  const Vector2 left(std::cos(half), -std::sin(half));  // tangent at -half
  Panel panel;
  panel.name = name;
  panel.corners = rows({at(-half, outer), at(half, outer), at(half, inner), at(-half, inner)});
  panel.edges = loop_of_edges(4);
  panel.edges[SkirtHem].controls = {at(-half, outer) + reach * outer * left,
                                    at(half, outer) - reach * outer * right};
  panel.edges[SkirtHem].name = "hem";
  panel.edges[SkirtWaist].controls = {at(half, inner) - reach * inner * right,
                                      at(-half, inner) + reach * inner * left};
  return panel;
}

struct Skirt {
  int front, back;
};

Skirt add_skirt(SewingPattern& pattern, const TailorMeasures& m, const SkirtOptions& options,
                double waist_per_panel) {
  ATELIER_CHECK(options.length > 0.05, "a skirt without length");
  ATELIER_CHECK(options.flare > 0.05 && options.flare < kPi, "flare is 0.05 to 3.1 rad");
  Panel front = skirt_panel("skirt front", waist_per_panel, options.length, options.flare);
  Panel back = front;
  back.name = "skirt back";
  const double half_hem = front.corners.col(0).maxCoeff();
  const double radius = std::max(1.05 * 2 * half_hem / kPi, m.hip_girth / (2 * kPi) + 0.03);
  const double height = front.corners.col(1).maxCoeff();
  const Vector3 axis(m.waist.x(), m.waist.y() - height, m.waist.z());
  front.placement = round_body(axis, radius, true);
  back.placement = round_body(axis, radius, false);
  const Skirt skirt{add_panel(pattern, front), add_panel(pattern, back)};
  pattern.seams.push_back({"skirt left side", skirt.front, SkirtRight, skirt.back, SkirtLeft});
  pattern.seams.push_back({"skirt right side", skirt.front, SkirtLeft, skirt.back, SkirtRight});
  return skirt;
}

// A leg whose outer side is +x; y = 0 at the hem, x = 0 on the leg's axis, the crotch at `fork`.
Panel leg_panel(const std::string& name, const TailorMeasures& m, const TrousersOptions& options,
                bool back, double fork) {
  const double hip = (m.hip_girth + options.ease) / 4;
  const double waist = (m.waist_girth + options.ease) / 4;
  const double extension = (back ? 0.11 : 0.05) * m.hip_girth / 1.0;  // of the crotch
  const double half_hem = options.opening / 4;
  const double top = m.inseam + options.rise;
  const double center = -hip / 2;
  Panel panel;
  panel.name = name;
  panel.corners = rows({{-half_hem, 0},
                        {half_hem, 0},
                        {center + waist + 0.01, top},
                        {center + 0.01, top},
                        {center - extension, fork}});
  panel.edges = loop_of_edges(kLegEdges);
  panel.edges[LegHem].name = "hem";
  panel.edges[LegWaist].name = "waist";
  const double seat = m.inseam + 0.45 * options.rise;
  panel.edges[Outseam].controls = {{half_hem + 0.4 * (hip / 2 - half_hem), 0.55 * m.inseam},
                                   {hip / 2 + 0.02, seat}};
  panel.edges[CenterSeam].controls = {{center, seat - 0.02}, {center, m.inseam + 0.01}};
  panel.edges[Inseam].controls = {{-half_hem - 0.01, 0.6 * m.inseam}};
  return panel;
}

// The height of the back's crotch at which its inseam, which reaches further, is as long as the
// front's: tailors lower it so.
double back_fork(const TailorMeasures& m, const TrousersOptions& options) {
  const auto inseam = [&](bool back, double fork) {
    return edge_length(leg_panel("leg", m, options, back, fork), Inseam);
  };
  const double front = inseam(false, m.inseam);
  double low = 0.5 * m.inseam;
  double high = m.inseam;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (inseam(true, middle) < front ? low : high) = middle;
  }
  return (low + high) / 2;
}

Panel mirror(Panel panel) {
  panel.corners.col(0) *= -1;
  for (PanelEdge& edge : panel.edges) {
    std::swap(edge.start, edge.end);
    std::reverse(edge.controls.begin(), edge.controls.end());
    for (Vector2& control : edge.controls) {
      control.x() *= -1;
    }
  }
  std::reverse(panel.edges.begin(), panel.edges.end());
  return panel;
}

}  // namespace

OptionTable describe(TeeOptions& options) {
  OptionTable table;
  table.add("ease", options.ease, 0, 1, "m", "Ease added to the chest girth")
      .add("length", options.length, 0, 1, "m", "Length below the waist")
      .add("sleeve", options.sleeve, 0.1, 1, "", "Fraction of the arm covered by the sleeve")
      .add("sleeve_ease", options.sleeve_ease, 0, 0.5, "m", "Ease added to the upper arm girth")
      .add("neck_depth", options.neck_depth, 0.02, 0.2, "m", "Depth of the neckline in front");
  return table;
}

OptionTable describe(SkirtOptions& options) {
  OptionTable table;
  table.add("length", options.length, 0.1, 1.2, "m", "Length from the waist down")
      .add("flare", options.flare, 0.05, 3.1, "rad",
           "Angle by which front and back are each flared")
      .add("ease", options.ease, 0, 0.5, "m", "Ease added to the waist girth");
  return table;
}

OptionTable describe(DressOptions& options) {
  OptionTable table;
  table.add("bodice", describe(options.bodice)).add("skirt", describe(options.skirt));
  return table;
}

OptionTable describe(TrousersOptions& options) {
  OptionTable table;
  table.add("ease", options.ease, 0, 0.5, "m", "Ease added to the hip girth")
      .add("opening", options.opening, 0.15, 1, "m", "Circumference of each hem")
      .add("rise", options.rise, 0.15, 0.4, "m", "Height from crotch to waist");
  return table;
}

SewingPattern tee_pattern(const TailorMeasures& m, const TeeOptions& options) {
  SewingPattern pattern;
  pattern.name = "tee";
  const double half_hem =
      std::max((m.chest_girth + options.ease) / 4,
               options.length > 0 ? (m.hip_girth + 0.5 * options.ease) / 4 : 0.0);
  const Bodice bodice = add_bodice(pattern, m, options, half_hem, m.waist.y() - options.length);
  for (const int panel : {bodice.front, bodice.back}) {
    pattern.panels[static_cast<std::size_t>(panel)].edges[BodiceHem].name = "hem";
  }
  return pattern;
}

SewingPattern skirt_pattern(const TailorMeasures& m, const SkirtOptions& options) {
  SewingPattern pattern;
  pattern.name = "skirt";
  const Skirt skirt = add_skirt(pattern, m, options, (m.waist_girth + options.ease) / 2);
  for (const int panel : {skirt.front, skirt.back}) {
    pattern.panels[static_cast<std::size_t>(panel)].edges[SkirtWaist].name = "waist";
  }
  return pattern;
}

SewingPattern dress_pattern(const TailorMeasures& m, const DressOptions& options) {
  SewingPattern pattern;
  pattern.name = "dress";
  const double waist_per_panel = (m.waist_girth + options.skirt.ease) / 2;
  const Bodice bodice = add_bodice(pattern, m, options.bodice, waist_per_panel / 2,
                                   m.waist.y() - options.bodice.length);
  const Skirt skirt = add_skirt(pattern, m, options.skirt, waist_per_panel);
  pattern.seams.push_back({"waist front", bodice.front, BodiceHem, skirt.front, SkirtWaist});
  pattern.seams.push_back({"waist back", bodice.back, BodiceHem, skirt.back, SkirtWaist});
  return pattern;
}

SewingPattern trousers_pattern(const TailorMeasures& m, const TrousersOptions& options) {
  ATELIER_CHECK(m.inseam > 0.2 && options.rise > 0.1, "trousers without legs");
  ATELIER_CHECK(m.hip_girth > 0.4 && m.waist_girth > 0.3, "trousers without width");
  SewingPattern pattern;
  pattern.name = "trousers";
  const double fork = back_fork(m, options);
  int panels[2][2];  // [left, right][front, back]
  for (const bool left : {true, false}) {
    for (const bool back : {false, true}) {
      const std::string name = std::string(left ? "left " : "right ") + (back ? "back" : "front");
      Panel panel = leg_panel(name, m, options, back, back ? fork : m.inseam);
      // The outer side is +x of a left front panel and of a right back panel.
      if (left == back) {
        panel = mirror(panel);
      }
      for (PanelEdge& edge : panel.edges) {
        if (edge.name == "hem") {
          edge.name = std::string(left ? "left" : "right") + " hem";
        }
      }
      const double width = panel.corners.col(0).maxCoeff() - panel.corners.col(0).minCoeff();
      const Vector3 ankle = left ? m.left_ankle : m.right_ankle;
      // Clear of the hips in front and behind.
      const double radius = std::max(1.15 * 2 * width / (2 * kPi), m.hip_girth / (2 * kPi) + 0.03);
      panel.placement = round_body(ankle, radius, !back);
      panels[left ? 0 : 1][back ? 1 : 0] = add_panel(pattern, panel);
    }
  }
  const auto [left_front, left_back] = std::pair(panels[0][0], panels[0][1]);
  const auto [right_front, right_back] = std::pair(panels[1][0], panels[1][1]);
  pattern.seams = {
      {"left outseam", left_front, Outseam, left_back, mirrored(Outseam)},
      {"left inseam", left_front, Inseam, left_back, mirrored(Inseam)},
      {"right outseam", right_back, Outseam, right_front, mirrored(Outseam)},
      {"right inseam", right_back, Inseam, right_front, mirrored(Inseam)},
      {"center front", left_front, CenterSeam, right_front, mirrored(CenterSeam)},
      {"center back", right_back, CenterSeam, left_back, mirrored(CenterSeam)},
  };
  return pattern;
}

}  // namespace atelier
