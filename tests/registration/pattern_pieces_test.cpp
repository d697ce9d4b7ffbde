#include "registration/flattening/pattern_pieces.h"

#include <cmath>
#include <fstream>
#include <regex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "registration/drafting/draft_pattern.h"
#include "registration/flattening/flat_overlaps.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/flatten_panel.h"
#include "registration/flattening/offset_outline.h"
#include "registration/sewing/parametric_patterns.h"
#include "registration/sewing/pattern_garment.h"
#include "tests/registration/cut_fixtures.h"
#include "tests/registration/pattern_files.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::no_cut;
using fixtures::opened;
using fixtures::topology;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A dress's panels as bent for the body, flat again and laid out.
PatternLayout dress_layout() {
  const Garment garment = garment_from_pattern(dress_pattern({}), {.edge_length = 0.04});
  FlatPattern flat = flatten_surface(garment.mesh, no_cut(topology(garment.mesh)));
  flat.panel_names = garment.panel_names;
  return lay_out_pattern(flat);
}

TEST(LayOutPattern, Pieces_LieApartOnTheFabric) {
  const PatternLayout layout = dress_layout();
  EXPECT_EQ(layout.pieces.size(), dress_pattern({}).panels.size());
  for (std::size_t i = 0; i < layout.pieces.size(); ++i) {
    const Points2& a = layout.pieces[i].cut_line;
    EXPECT_GE(a.col(0).minCoeff(), -1e-9);
    EXPECT_LE(a.col(0).maxCoeff(), layout.width + 1e-9);
    EXPECT_GE(a.col(1).minCoeff(), -1e-9);
    EXPECT_FALSE(crosses_itself(a));
    // Vertices of the others are outside of it.
    for (std::size_t j = 0; j < layout.pieces.size(); ++j) {
      if (j == i) {
        continue;
      }
      const Points2& b = layout.pieces[j].cut_line;
      for (Index v = 0; v < b.rows(); ++v) {
        bool inside = false;
        for (Index k = 0, l = a.rows() - 1; k < a.rows(); l = k++) {
          if ((a(k, 1) > b(v, 1)) != (a(l, 1) > b(v, 1)) &&
              b(v, 0) < (a(l, 0) - a(k, 0)) * (b(v, 1) - a(k, 1)) / (a(l, 1) - a(k, 1)) + a(k, 0)) {
            inside = !inside;
          }
        }
        EXPECT_FALSE(inside);
      }
    }
  }
}

TEST(PatternSvg, Svg_IsAtTrueScale) {
  const PatternLayout layout = dress_layout();
  const fixtures::ReadSvg svg = fixtures::read_svg(pattern_svg(layout, "a <dress> & \"more\""));
  EXPECT_THAT(svg.layers,
              ElementsAre("cut", "sew", "grain", "fold", "notches", "text", "names", "scale"));
  EXPECT_NEAR(svg.width, 1000 * layout.width + 40, 1e-3);
  EXPECT_NEAR(std::abs(fixtures::area_of(svg.paths.at("square-100mm"))), 1e4, 1e-2);
  for (const PatternPiece& piece : layout.pieces) {
    fixtures::Loop line;
    for (Index i = 0; i < piece.sew_line.rows(); ++i) {
      line.emplace_back(piece.sew_line(i, 0), piece.sew_line(i, 1));
    }
    const double area = 1e6 * fixtures::area_of(line);
    // y runs down: clockwise.
    EXPECT_NEAR(fixtures::area_of(svg.paths.at("sew-" + piece.name)), -area, 1e-4 * area);
    EXPECT_LT(fixtures::area_of(svg.paths.at("cut-" + piece.name)), -area);
  }
}

/// SVGLoader of three.js scales lengths that have a unit and leaves paths of the same file.
TEST(PatternSvg, Lengths_HaveNoUnitBesideThePage) {
  const std::string svg = pattern_svg(dress_layout(), "dress");
  const std::string inside = svg.substr(svg.find("viewBox="));
  const std::regex length("=\"-?[0-9.]+ *(mm|cm|in|pt|pc|px)\"");
  EXPECT_FALSE(std::regex_search(inside, length));
  EXPECT_TRUE(std::regex_search(svg, length)) << "width and height of the page";
}

TEST(PatternDxf, Dxf_IsReadElsewhereAtTrueScale) {
  const PatternLayout layout = dress_layout();
  const fixtures::ReadDxf dxf = fixtures::read_dxf(pattern_dxf(layout, "dress"));
  EXPECT_EQ(dxf.version, "AC1009");
  EXPECT_EQ(dxf.inserted.size(), layout.pieces.size());
  EXPECT_THAT(dxf.texts, ::testing::Contains("UNITS: METRIC"));
  std::vector<double> areas;
  for (const PatternPiece& piece : layout.pieces) {
    fixtures::Loop line;
    for (Index i = 0; i < piece.sew_line.rows(); ++i) {
      line.emplace_back(1000 * piece.sew_line(i, 0), 1000 * piece.sew_line(i, 1));
    }
    areas.push_back(fixtures::area_of(line));
  }
  for (std::size_t i = 0; i < dxf.inserted.size(); ++i) {
    const auto& block = dxf.closed.at(dxf.inserted[i]);
    ASSERT_EQ(block.at("1").size(), 1U);
    ASSERT_EQ(block.at("14").size(), 1U);
    EXPECT_NEAR(fixtures::area_of(block.at("14").front()), areas[i], 1e-4 * areas[i]);
    EXPECT_GT(fixtures::area_of(block.at("1").front()), areas[i]);
    EXPECT_EQ(dxf.lines.at(dxf.inserted[i]).at("7"), 1);
  }
}

TEST(LayOutPattern, SewnSides_HaveNotchesAtTheSameLengths) {
  const Mesh tube = fixtures::tube(24, 8, 2);
  const PatternLayout layout = lay_out_pattern(flatten_surface(tube, opened(tube)));
  ASSERT_EQ(layout.pieces.size(), 1U);
  EXPECT_GT(layout.width, 6);  // wider than the fabric that was asked for
  const auto& notches = layout.pieces[0].notches;
  ASSERT_GE(notches.size(), 2U);
  EXPECT_EQ(notches.size() % 2, 0U);
  EXPECT_NEAR(notches[0].position.y(), notches[1].position.y(), 1e-3);
  EXPECT_LT(notches[0].outwards.dot(notches[1].outwards), -0.9);
  EXPECT_LT(layout.seam_mismatch, 0.003);
}

}  // namespace
}  // namespace atelier
