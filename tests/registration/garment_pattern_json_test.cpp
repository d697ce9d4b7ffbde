#include "registration/sewing/garment_pattern_json.h"

#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/sewing/pattern_garment.h"
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
