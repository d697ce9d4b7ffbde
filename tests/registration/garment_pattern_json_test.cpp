#include "registration/sewing/garment_pattern_json.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/sewing/pattern_garment.h"
#include "tests/support/places.h"
#include "tests/support/read_text.h"
#include "tests/support/refusals.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

SewingPattern parse(const std::string& text) {
  return garment_pattern_from_json(text, "p.json");
}

std::string good() {
  return R"({"properties": {"curvature_coords": "relative", "units_in_meter": 100},
    "pattern": {"panels": {
      "front": {"translation": [0, 0, 20], "rotation": [0, 0, 0],
        "vertices": [[0, 0], [40, 0], [40, 30], [0, 30]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2], "curvature": [0.5, -0.1]},
                  {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]},
      "back": {"translation": [0, 0, -20], "rotation": [0, 0, 0],
        "vertices": [[0, 0], [40, 0], [40, 30], [0, 30]],
        "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2], "curvature": [0.5, -0.1]},
                  {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]}},
    "stitches": [[{"panel": "front", "edge": 1}, {"panel": "back", "edge": 1}]]}})";
}

std::string replaced(const std::string& from, const std::string& to) {
  std::string text = good();
  text.replace(text.find(from), from.size(), to);
  return text;
}

TEST(GarmentPatternJson, CurvatureOfTheOtherKind_IsRefusedWithItsName) {
  ATELIER_EXPECT_REFUSED(parse(replaced("[0.5, -0.1]", "[44, 15]")), DataError,
                         "as curvature_coords \"absolute\" makes of these numbers");
  std::string absolute = replaced("\"relative\"", "\"absolute\"");
  for (std::size_t at; (at = absolute.find("[0.5, -0.1]")) != std::string::npos;) {
    absolute.replace(at, 11, "[44, 15]");
  }
  EXPECT_EQ(parse(absolute).panels.size(), 2U);
  // A small number in centimetres may be a place; far from an edge it is a share of it.
  std::string shares = replaced("\"relative\"", "\"absolute\"");
  for (const char* corner : {"[40, 0]", "[40, 30]", "[0, 0]", "[0, 30]"}) {
    const std::string from = corner;
    for (std::size_t at = 0; (at = shares.find(from, at)) != std::string::npos; at += 4) {
      shares.insert(at + 1, "3");
    }
  }
  ATELIER_EXPECT_REFUSED(parse(shares), DataError, "edge lengths away");
}

TEST(GarmentPatternJson, OutlineLikeAnEight_IsSaidToCrossItself) {
  ATELIER_EXPECT_REFUSED(parse(replaced("[[0, 0], [40, 0], [40, 30], [0, 30]]",
                                        "[[0, 0], [40, 0], [0, 30], [40, 30]]")),
                         DataError, "crosses itself");
}

TEST(GarmentPatternJson, UnitsCurvesAndStitches_AreRead) {
  const SewingPattern pattern = parse(good());
  ASSERT_EQ(pattern.panels.size(), 2U);
  for (const Panel& panel : pattern.panels) {
    EXPECT_DOUBLE_EQ(panel.corners.col(0).maxCoeff() - panel.corners.col(0).minCoeff(), 0.4);
    std::size_t controls = 0;
    for (const PanelEdge& edge : panel.edges) {
      controls += edge.controls.size();
    }
    EXPECT_EQ(controls, 1U);
  }
  EXPECT_DOUBLE_EQ(pattern.panels[1].placement.origin.z(), 0.2);  // panels are sorted by name
  ASSERT_EQ(pattern.seams.size(), 1U);
  // Both edges of the file run upward at the same place: one panel is turned over, where it lies.
  EXPECT_TRUE(pattern.seams[0].reversed);
  for (const Panel& panel : pattern.panels) {
    for (Index i = 0; i < panel.corners.rows(); ++i) {
      const Eigen::Vector3d p = place(panel.placement, panel.corners.row(i).transpose());
      EXPECT_NEAR(p.z(), panel.placement.origin.z(), 1e-12);
      EXPECT_GE(p.x(), -1e-12);
      EXPECT_LE(p.x(), 0.4 + 1e-12);
    }
  }
}

SewingPattern garmentcode(const std::string& name) {
  const std::filesystem::path file =
      fixtures::source_directory() / "tests/registration/cases/44-garmentcode" / (name + ".json");
  return garment_pattern_from_json(fixtures::read_text(file), name + ".json");
}

/// Length of the longest curved edge of a panel, cm.
double curve_length(const Panel& panel) {
  double longest = 0;
  for (std::size_t e = 0; e < panel.edges.size(); ++e) {
    if (!is_straight(panel.edges[e])) {
      longest = std::max(longest, 100 * edge_length(panel, static_cast<int>(e)));
    }
  }
  return longest;
}

TEST(GarmentCode, CurvesAsObjects_AreThoseOfItsSpecification) {
  const double straight = (44 + 70) / 2.0 * 55;  // cm2
  for (const char* name : {"quadratic", "old_quadratic"}) {
    for (const Panel& panel : garmentcode(name).panels) {
      // A parabola over 44 cm whose control point is 2.64 cm below its middle.
      EXPECT_NEAR(1e4 * panel_area(panel), straight - 2.0 / 3 * 44 * 0.5 * 2.64, 1e-2) << name;
    }
  }
  for (const Panel& panel : garmentcode("cubic").panels) {
    // x = 44 (0.33 B1 + 0.67 B2 + B3), y = -2.64 (B1 + B2) of Bernstein's polynomials.
    double below = 0;
    double length = 0;
    Eigen::Vector2d before(0, 0);
    constexpr int kSteps = 20000;
    for (int i = 1; i <= kSteps; ++i) {
      const double t = static_cast<double>(i) / kSteps;
      const double b1 = 3 * t * (1 - t) * (1 - t);
      const double b2 = 3 * t * t * (1 - t);
      const Eigen::Vector2d now(44 * (0.33 * b1 + 0.67 * b2 + t * t * t), -2.64 * (b1 + b2));
      below -= 0.5 * (now.y() + before.y()) * (now.x() - before.x());
      length += (now - before).norm();
      before = now;
    }
    EXPECT_NEAR(1e4 * panel_area(panel), straight - below, 1e-2);
    EXPECT_NEAR(curve_length(panel), length, 1e-3);
  }
}

TEST(GarmentCode, CircleEdge_IsAnArcOfItsRadius) {
  const double half = std::asin(35.0 / 90);
  const double segment = 0.5 * 90 * 90 * (2 * half - std::sin(2 * half));
  for (const Panel& panel : garmentcode("circle").panels) {
    EXPECT_NEAR(curve_length(panel), 2 * 90 * half, 1e-2);
    // The loop is clockwise, so that an arc to the right bulges inwards.
    EXPECT_NEAR(1e4 * panel_area(panel), (44 + 70) / 2.0 * 55 - segment, 0.1);
  }
  Panel panel;
  panel.corners.resize(2, 2);
  panel.corners << 0, 0, 2, 0;
  panel.edges = {{0, 1, {}, "", 1.0}, {1, 0, {}, "", 1.0}};  // two semicircles: a disc
  EXPECT_NEAR(panel_area(panel), std::numbers::pi, 1e-3);
  EXPECT_NEAR(sample_edge(panel, 0, 2)(1, 1), -1, 1e-4);
  panel.edges[0].bulge = -0.2;  // above the chord
  EXPECT_GT(sample_edge(panel, 0, 2)(1, 1), 0.19);
}

TEST(GarmentCode, LargerArc_IsTheOtherPartOfTheCircle) {
  std::string text = good();
  const std::string plain = "{\"endpoints\": [2, 3]}";
  const std::string arc =
      "{\"endpoints\": [2, 3], \"curvature\": {\"type\": \"circle\", \"params\": [25, 1, 1]}}";
  text.replace(text.find(plain), plain.size(), arc);
  const SewingPattern pattern = parse(text);
  const double angle = 2 * std::numbers::pi - 2 * std::asin(20.0 / 25);
  EXPECT_NEAR(curve_length(pattern.panels[1]), 25 * angle, 0.05);
}

TEST(GarmentCode, RightWrongStitch_JoinsStartWithStart) {
  const auto joined = [](const SewingPattern& pattern) {
    std::vector<double> rises;
    for (const SewnEdges& seam : pattern.seams) {
      const Panel& a = pattern.panels[static_cast<std::size_t>(seam.panel_a)];
      const Panel& b = pattern.panels[static_cast<std::size_t>(seam.panel_b)];
      const PanelEdge& edge_a = a.edges[static_cast<std::size_t>(seam.edge_a)];
      const PanelEdge& edge_b = b.edges[static_cast<std::size_t>(seam.edge_b)];
      rises.push_back(a.corners(edge_a.start, 1) -
                      b.corners(seam.reversed ? edge_b.end : edge_b.start, 1));
    }
    return rises;
  };
  for (const double rise : joined(garmentcode("quadratic"))) {
    EXPECT_NEAR(rise, 0, 1e-12);
  }
  for (const double rise : joined(garmentcode("right_wrong"))) {
    EXPECT_NEAR(std::abs(rise), 0.55, 1e-12);
  }
}

TEST(GarmentCode, FilesThatAreNoPattern_AreRefusedWithTheReason) {
  EXPECT_THROW(garmentcode("edge_twice"), DataError);
  EXPECT_THROW(garmentcode("open_loop"), DataError);
  ATELIER_EXPECT_REFUSED(parse("body:\n  height: 171.99\n"), DataError, "measures of a body");
  ATELIER_EXPECT_REFUSED(parse(R"({"body": {"height": 171.99}})"), DataError,
                         "*_specification.json");
  ATELIER_EXPECT_REFUSED(parse("design:\n  meta:\n"), DataError, "parameters of a design");
  ATELIER_EXPECT_REFUSED(parse(replaced("[0.5, -0.1]", R"({"type": "spline", "params": []})")),
                         DataError, "quadratic, cubic or circle");
  ATELIER_EXPECT_REFUSED(
      parse(replaced("[0.5, -0.1]", R"({"type": "circle", "params": [10, 0, 1]})")), DataError,
      "at least half the distance");
  ATELIER_EXPECT_REFUSED(
      parse(replaced("[0.5, -0.1]", R"({"type": "cubic", "params": [[0.5, 0.1]]})")), DataError,
      "2 control points");
  ATELIER_EXPECT_REFUSED(parse(replaced("\"edge\": 1}]]", "\"edge\": 1}, \"wrong\"]]")), DataError,
                         "right_wrong");
}

TEST(GarmentPatternJson, EveryRealPattern_BecomesAGarment) {
  ATELIER_TEST_FILE(root, "garments/pattern_generator/Patterns");
  int count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    if (entry.path().extension() != ".json") {
      continue;
    }
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    const SewingPattern pattern = garment_pattern_from_json(text, entry.path().filename().string());
    const Garment garment = garment_from_pattern(pattern, {.edge_length = 0.03});
    EXPECT_NO_THROW(check_garment(garment)) << entry.path();
    EXPECT_EQ(garment.seams.size(), pattern.seams.size());
    for (const Seam& seam : garment.seams) {
      // Sewn the right way round, no thread is much longer than the way between the panels.
      double longest = 0;
      double mean = 0;
      for (std::size_t i = 0; i < seam.a.size(); ++i) {
        const double thread =
            (garment.mesh.vertices.row(seam.a[i]) - garment.mesh.vertices.row(seam.b[i])).norm();
        longest = std::max(longest, thread);
        mean += thread / static_cast<double>(seam.a.size());
      }
      EXPECT_LT(longest, 0.6) << entry.path() << " " << seam.name;
      EXPECT_LT(mean, 0.45) << entry.path() << " " << seam.name;
    }
    ++count;
  }
  EXPECT_GE(count, 15);
}

void expect_refused_json(const std::string& text, const std::string& words) {
  try {
    parse(text);
    FAIL() << "accepted: " << words;
  } catch (const DataError& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

TEST(GarmentPatternJsonRefused, NonPatternJson_IsRefused) {
  expect_refused_json("{}", "no 'properties'");
  expect_refused_json("[1, 2]", "no 'properties'");
  expect_refused_json("{", "p.json");
  expect_refused_json(replaced("\"panels\"", "\"panel\""), "no 'panels'");
  expect_refused_json(replaced("\"stitches\"", "\"seams\""), "no 'stitches'");
}

TEST(GarmentPatternJsonRefused, BadUnitsAndCurvature_AreRefused) {
  expect_refused_json(replaced("100", "0"), "units_in_meter");
  expect_refused_json(replaced("100", "\"m\""), "a number");
  expect_refused_json(replaced("\"relative\"", "\"polar\""), "relative or absolute");
  expect_refused_json(replaced("[0.5, -0.1]", "[0.5]"), "2 numbers");
}

TEST(GarmentPatternJsonRefused, WrongUnit_IsNamedWithTheSizeThatItMakes) {
  expect_refused_json(replaced("100", "1"),
                      "units_in_meter: 1, by which the largest panel is 40 m");
  expect_refused_json(replaced("100", "10000"), "by which the largest panel is 0.004 m");
  expect_refused_json(replaced("100", "0.01"), "4000 m");
  EXPECT_EQ(parse(replaced("100", "10")).panels.size(), 2U) << "a train of 4 m";
}

TEST(GarmentPatternJsonRefused, BadIndicesAndNames_AreRefused) {
  expect_refused_json(replaced("[0, 1]", "[0, 4]"), "an index from 0 to 4");
  expect_refused_json(replaced("[0, 1]", "[-1, 1]"), "an index from 0 to 4");
  expect_refused_json(replaced("[0, 1]", "[0, 1.5]"), "an index");
  expect_refused_json(replaced("\"panel\": \"front\"", "\"panel\": \"side\""),
                      "the name of a panel");
  expect_refused_json(replaced("\"edge\": 1", "\"edge\": 9"), "an index from 0 to 4");
  expect_refused_json(replaced("[[0, 0], [40, 0]", "[[0, 0], [40]"), "2 numbers");
}

}  // namespace
}  // namespace atelier
