#include "registration/drafting/drawing_measures.h"

#include <gtest/gtest.h>

#include "registration/drafting/draft_pattern.h"
#include "tests/registration/cut_fixtures.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

TEST(GarmentPart, Panels_ArePartsWithoutTheirNumbers) {
  EXPECT_EQ(garment_part("front"), "front");
  EXPECT_EQ(garment_part("front left 2"), "front");
  EXPECT_EQ(garment_part("back upper"), "back");
  EXPECT_EQ(garment_part("sleeve left 2"), "sleeve left");
  EXPECT_EQ(garment_part("sleeve right lower"), "sleeve right");
  EXPECT_EQ(garment_part("sleeve"), "sleeve");
}

/// A tube cut open, drawn in lines.
struct OpenTube {
  Mesh mesh = fixtures::tube(32, 10, 0.6);
  FlatPattern flat;
  PatternNames names;

  OpenTube() {
    mesh.vertices.col(0) *= 0.2;
    mesh.vertices.col(2) *= 0.2;
    flat = flatten_surface(mesh, fixtures::opened(mesh));
    names = own_names(flat);
  }
};

TEST(MeasureDrawing, Rectangle_IsOnePanelOfOnePartAndNotRagged) {
  const OpenTube tube;
  const DrawingMeasures measures =
      measure_drawing(draft_pattern(tube.flat, tube.names), tube.names.panels, tube.flat);
  EXPECT_LT(measures.raggedness, 2e-4);
  EXPECT_EQ(measures.parts, 1);
  EXPECT_EQ(measures.panels_a_part, 1);
}

TEST(MeasureDrawing, ZigzagUnderAStraightLine_IsRaggedByIt) {
  OpenTube tube;
  const SewingPattern drafted = draft_pattern(tube.flat, tube.names);
  const double low = tube.flat.vertices.col(1).minCoeff();
  int tooth = 0;
  for (Index v = 0; v < tube.flat.vertices.rows(); ++v) {
    if (tube.flat.vertices(v, 1) < low + 1e-3) {
      tube.flat.vertices(v, 1) += tooth++ % 2 == 0 ? 0.01 : 0;
    }
  }
  const double raggedness = measure_drawing(drafted, tube.names.panels, tube.flat).raggedness;
  EXPECT_GT(raggedness, 1.5e-3);
  EXPECT_LT(raggedness, 0.01);
}

TEST(MeasureDrawing, PanelsOfOnePart_AreCountedForIt) {
  OpenTube tube;
  const SewingPattern drafted = draft_pattern(tube.flat, tube.names);
  // Names alone say it: of five panels, two of one sleeve.
  const std::vector<std::string> names = {tube.names.panels[0], "back", "sleeve left 1",
                                          "sleeve left 2", "sleeve right"};
  const DrawingMeasures measures = measure_drawing(drafted, names, tube.flat);
  EXPECT_EQ(measures.parts, 4);
  EXPECT_EQ(measures.panels_a_part, 1.25);
}

}  // namespace
}  // namespace atelier
