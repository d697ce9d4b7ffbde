#include "registration/sewing/sewing_pattern.h"

#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/topology.h"
#include "registration/sewing/panel_triangulation.h"
#include "registration/sewing/parametric_patterns.h"
#include "registration/sewing/pattern_garment.h"

namespace atelier {
namespace {

SewingPattern square_pattern() {
  Panel panel;
  panel.name = "square";
  panel.corners.resize(4, 2);
  panel.corners << 0, 0, 0.4, 0, 0.4, 0.3, 0, 0.3;
  panel.edges = {{0, 1, {}, "hem"}, {1, 2, {}, ""}, {2, 3, {}, ""}, {3, 0, {}, ""}};
  SewingPattern pattern;
  pattern.name = "square";
  pattern.panels = {panel};
  return pattern;
}

std::vector<SewingPattern> all_patterns() {
  const TailorMeasures measures;
  return {tee_pattern(measures), skirt_pattern(measures), dress_pattern(measures),
          trousers_pattern(measures)};
}

TEST(SewingPattern, KnownShapes_HaveTheirLengthsAndAreas) {
  SewingPattern pattern = square_pattern();
  EXPECT_DOUBLE_EQ(panel_area(pattern.panels[0]), 0.12);
  EXPECT_DOUBLE_EQ(edge_length(pattern.panels[0], 0), 0.4);
  // A quarter circle of radius 1 as a cubic: length pi/2 to 3e-4.
  Panel round;
  round.corners.resize(3, 2);
  round.corners << 0, 0, 1, 0, 0, 1;
  const double k = 4.0 / 3 * std::tan(std::numbers::pi / 8);
  round.edges = {{0, 1, {}, ""}, {1, 2, {{1, k}, {k, 1}}, ""}, {2, 0, {}, ""}};
  EXPECT_NEAR(edge_length(round, 1), std::numbers::pi / 2, 5e-4);
  EXPECT_NEAR(panel_area(round), std::numbers::pi / 4, 5e-4);
  const Points2 samples = sample_edge(round, 1, 10);
  for (Index i = 0; i + 1 < samples.rows(); ++i) {
    EXPECT_NEAR((samples.row(i + 1) - samples.row(i)).norm(), std::numbers::pi / 20, 2e-3);
  }
}

TEST(SewingPattern, BentPanels_KeepLengthsAroundTheCylinder) {
  PanelPlacement placement;
  placement.bend_radius = 0.2;
  placement.origin = {0, 1, 0.2};
  const Eigen::Vector3d axis(0, 1, 0);
  for (const double x : {-0.3, 0.0, 0.25}) {
    const Eigen::Vector3d p = place(placement, {x, 0});
    EXPECT_NEAR((p - axis).norm(), 0.2, 1e-12);
  }
}

TEST(ParametricPatterns, EveryDraft_IsValidWithEqualSeams) {
  for (const SewingPattern& pattern : all_patterns()) {
    EXPECT_NO_THROW(check_sewing_pattern(pattern)) << pattern.name;
    for (const SewnEdges& seam : pattern.seams) {
      const double a =
          edge_length(pattern.panels[static_cast<std::size_t>(seam.panel_a)], seam.edge_a);
      const double b =
          edge_length(pattern.panels[static_cast<std::size_t>(seam.panel_b)], seam.edge_b);
      EXPECT_LT(std::abs(a - b) / std::max(a, b), 1e-3) << pattern.name << " " << seam.name;
    }
  }
}

TEST(ParametricPatterns, Openings_AreThoseOfTheGarment) {
  const auto openings = [](const SewingPattern& pattern) {
    const Garment garment = garment_from_pattern(pattern);
    return std::multiset<std::string>(garment.boundary_names.begin(), garment.boundary_names.end());
  };
  const TailorMeasures measures;
  EXPECT_EQ(openings(tee_pattern(measures)),
            (std::multiset<std::string>{"hem", "left cuff", "neck", "right cuff"}));
  EXPECT_EQ(openings(skirt_pattern(measures)), (std::multiset<std::string>{"hem", "waist"}));
  EXPECT_EQ(openings(dress_pattern(measures)),
            (std::multiset<std::string>{"hem", "left cuff", "neck", "right cuff"}));
  EXPECT_EQ(openings(trousers_pattern(measures)),
            (std::multiset<std::string>{"left hem", "right hem", "waist"}));
}

// Welding the seams of a tee leaves a surface with the openings above and no other boundary.
TEST(PatternGarment, SewnGarment_IsManifoldWithItsOpenings) {
  for (const SewingPattern& pattern : all_patterns()) {
    const Garment garment = garment_from_pattern(pattern);
    std::vector<int> weld(static_cast<std::size_t>(garment.mesh.vertices.rows()));
    for (std::size_t i = 0; i < weld.size(); ++i) {
      weld[i] = static_cast<int>(i);
    }
    const auto find = [&](int v) {
      while (weld[static_cast<std::size_t>(v)] != v) {
        v = weld[static_cast<std::size_t>(v)];
      }
      return v;
    };
    for (const Seam& seam : garment.seams) {
      for (std::size_t i = 0; i < seam.a.size(); ++i) {
        const int a = find(seam.a[i]);
        const int b = find(seam.b[i]);
        weld[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
      }
    }
    std::map<std::pair<int, int>, int> edge_use;
    for (Index f = 0; f < garment.mesh.faces.rows(); ++f) {
      for (int i = 0; i < 3; ++i) {
        ++edge_use[{find(garment.mesh.faces(f, i)), find(garment.mesh.faces(f, (i + 1) % 3))}];
      }
    }
    std::size_t boundary = 0;
    for (const auto& [edge, count] : edge_use) {
      EXPECT_EQ(count, 1) << pattern.name << ": inconsistent orientation or a non-manifold edge";
      boundary += edge_use.count({edge.second, edge.first}) == 0 ? 1 : 0;
    }
    std::size_t named = 0;
    for (const auto& loop : garment.boundaries) {
      named += loop.size();
    }
    EXPECT_EQ(boundary, named) << pattern.name;
  }
}

TEST(PatternGarment, Triangles_AreWellShapedAndCoverThePanel) {
  for (const SewingPattern& pattern : all_patterns()) {
    const Garment garment = garment_from_pattern(pattern, {.edge_length = 0.025});
    double area = 0;
    double worst_angle = 180;
    for (Index f = 0; f < garment.rest_faces.rows(); ++f) {
      Eigen::Vector2d p[3];
      for (int i = 0; i < 3; ++i) {
        p[i] = garment.rest.row(garment.rest_faces(f, i)).transpose();
      }
      const Eigen::Vector2d u = p[1] - p[0];
      const Eigen::Vector2d v = p[2] - p[0];
      area += (u.x() * v.y() - u.y() * v.x()) / 2;
      for (int i = 0; i < 3; ++i) {
        const Eigen::Vector2d a = (p[(i + 1) % 3] - p[i]).normalized();
        const Eigen::Vector2d b = (p[(i + 2) % 3] - p[i]).normalized();
        worst_angle = std::min(worst_angle, std::acos(a.dot(b)) * 180 / std::numbers::pi);
      }
    }
    double expected = 0;
    for (const Panel& panel : pattern.panels) {
      expected += panel_area(panel);
    }
    EXPECT_NEAR(area / expected, 1, 0.01) << pattern.name;
    EXPECT_GT(worst_angle, 12) << pattern.name;
    EXPECT_NO_THROW(check_garment(garment));
  }
}

TEST(PatternGarment, SeamSides_HaveEqualSegmentLengths) {
  const Garment garment = garment_from_pattern(skirt_pattern({}));
  for (const Seam& seam : garment.seams) {
    ASSERT_EQ(seam.a.size(), seam.b.size());
    for (std::size_t i = 0; i + 1 < seam.a.size(); ++i) {
      const double a = (garment.rest.row(seam.a[i + 1]) - garment.rest.row(seam.a[i])).norm();
      const double b = (garment.rest.row(seam.b[i + 1]) - garment.rest.row(seam.b[i])).norm();
      EXPECT_NEAR(a, b, 1e-9);
    }
  }
}

TEST(PatternGarment, SeamSides_KeepCurveLengthAtEveryEdgeLength) {
  // A sleeve's cap bends more than its armhole: chords alone differ by 2% at 35 mm.
  for (const double edge : {0.035, 0.02, 0.01}) {
    for (const SewingPattern& pattern : all_patterns()) {
      const Garment garment = garment_from_pattern(pattern, {.edge_length = edge});
      for (std::size_t s = 0; s < garment.seams.size(); ++s) {
        const SewnEdges& sewn = pattern.seams[s];
        const auto length = [&](const std::vector<int>& side) {
          double sum = 0;
          for (std::size_t i = 1; i < side.size(); ++i) {
            sum += (garment.rest.row(side[i]) - garment.rest.row(side[i - 1])).norm();
          }
          return sum;
        };
        const double curve_a =
            edge_length(pattern.panels[static_cast<std::size_t>(sewn.panel_a)], sewn.edge_a);
        const double curve_b =
            edge_length(pattern.panels[static_cast<std::size_t>(sewn.panel_b)], sewn.edge_b);
        EXPECT_NEAR(length(garment.seams[s].a), curve_a, 1e-6) << pattern.name << " " << sewn.name;
        EXPECT_NEAR(length(garment.seams[s].b), curve_b, 1e-6) << pattern.name << " " << sewn.name;
      }
    }
  }
}

TEST(PatternGarment, MirroredSides_HaveEqualAreas) {
  // Left and right sleeves of the same draft have the same number of vertices and area.
  const SewingPattern pattern = tee_pattern({});
  EXPECT_NEAR(panel_area(pattern.panels[2]), panel_area(pattern.panels[3]), 1e-12);
}

std::string words(const SewingPattern& pattern) {
  try {
    check_sewing_pattern(pattern, "p.json");
  } catch (const DataError& error) {
    return error.what();
  }
  return "accepted";
}

void expect_refused_pattern(const SewingPattern& pattern, const std::string& expected) {
  EXPECT_NE(words(pattern).find(expected), std::string::npos) << words(pattern);
}

TEST(SewingPatternRefused, PanelsThatAreNoLoop_AreRefused) {
  expect_refused_pattern(SewingPattern{}, "no panels");
  SewingPattern pattern = square_pattern();
  pattern.panels[0].edges[1].end = 3;
  expect_refused_pattern(pattern, "does not end where the next one starts");
  pattern = square_pattern();
  pattern.panels[0].edges[1].end = 9;
  expect_refused_pattern(pattern, "a corner that does not exist");
  pattern = square_pattern();
  pattern.panels[0].edges.resize(1);
  expect_refused_pattern(pattern, "a closed loop");
  pattern = square_pattern();
  pattern.panels[0].corners.row(1) = pattern.panels[0].corners.row(0);
  expect_refused_pattern(pattern, "no length");
}

TEST(SewingPatternRefused, CrossingOrClockwiseOutlines_AreRefused) {
  SewingPattern pattern = square_pattern();
  pattern.panels[0].corners.col(0) *= -1;
  expect_refused_pattern(pattern, "counter-clockwise");
  pattern = square_pattern();
  pattern.panels[0].corners.row(2) << 0.2, -0.1;
  expect_refused_pattern(pattern, "crosses itself");
  pattern = square_pattern();
  pattern.panels[0].corners(2, 0) = NAN;
  expect_refused_pattern(pattern, "not finite");
  pattern = square_pattern();
  pattern.panels[0].edges[0].controls.assign(3, {0, 0});
  expect_refused_pattern(pattern, "3 control points");
}

TEST(SewingPatternRefused, DanglingOrRepeatedSeams_AreRefused) {
  SewingPattern pattern = square_pattern();
  pattern.seams = {{"side", 0, 1, 1, 3}};
  expect_refused_pattern(pattern, "panel 1");
  pattern.seams = {{"side", 0, 1, 0, 7}};
  expect_refused_pattern(pattern, "edge 7");
  pattern.seams = {{"side", 0, 1, 0, 1}};
  expect_refused_pattern(pattern, "not sewn already");
  pattern = square_pattern();
  pattern.panels.push_back(pattern.panels[0]);
  expect_refused_pattern(pattern, "a unique name");
}

TEST(ParametricPatternsRefused, ImpossibleMeasures_AreRefused) {
  TailorMeasures measures;
  measures.shoulder_width = 0.05;
  EXPECT_THROW(tee_pattern(measures), LogicError);
  measures = {};
  measures.inseam = 0;
  EXPECT_THROW(trousers_pattern(measures), LogicError);
  EXPECT_THROW(skirt_pattern({}, {.length = 0}), LogicError);
  EXPECT_THROW(skirt_pattern({}, {.flare = 4}), LogicError);
  EXPECT_THROW(garment_from_pattern(square_pattern(), {.edge_length = 0}), LogicError);
}

TEST(PanelTriangulationRefused, BadOutlines_AreRefused) {
  Points2 outline(2, 2);
  outline << 0, 0, 1, 0;
  EXPECT_THROW(triangulate_outline(outline, 0.1), DataError);
  outline.resize(4, 2);
  outline << 0, 0, 1, 1, 1, 0, 0, 1;
  EXPECT_THROW(triangulate_outline(outline, 0.1), DataError);
  outline << 0, 0, 1, 0, 0, 0, 0, 1;
  EXPECT_THROW(triangulate_outline(outline, 0.1), DataError);
  EXPECT_THROW(triangulate_outline(outline, 0), LogicError);
}

}  // namespace
}  // namespace atelier
