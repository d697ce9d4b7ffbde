#include "registration/drafting/draft_pattern.h"

#include <cmath>
#include <fstream>
#include <numbers>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/drafting/exchange_dxf.h"
#include "registration/drafting/garment_pattern_text.h"
#include "registration/drafting/name_pattern.h"
#include "registration/outlines/outline_measures.h"
#include "registration/sewing/garment_pattern_json.h"
#include "registration/sewing/parametric_patterns.h"
#include "registration/sewing/pattern_garment.h"
#include "tests/registration/cut_fixtures.h"
#include "tests/support/child_process.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using fixtures::opened;
using ::testing::Contains;
using ::testing::UnorderedElementsAre;

/// A tube, as a skirt, in front and back.
struct TwoPanels {
  Mesh mesh = fixtures::tube(32, 10, 0.6);
  FlatPattern flat;
  PatternNames names;

  TwoPanels() {
    mesh.vertices.col(0) *= 0.2;
    mesh.vertices.col(2) *= 0.2;
    const Topology topology = fixtures::topology(mesh);
    std::vector<int> labels;
    for (Index f = 0; f < mesh.faces.rows(); ++f) {
      double ahead = 0;
      for (int k = 0; k < 3; ++k) {
        ahead += mesh.vertices(mesh.faces(f, k), 2);
      }
      labels.push_back(ahead > 0 ? 1 : 0);
    }
    flat = flatten_surface(mesh, cut_between_labels(topology, labels));
    names = name_pattern(flat, mesh, Eigen::Vector3d::UnitZ());
  }
};

TEST(NamePattern, Skirt_HasFrontBackSidesWaistAndHem) {
  const TwoPanels skirt;
  EXPECT_THAT(skirt.names.panels, UnorderedElementsAre("front", "back"));
  EXPECT_THAT(skirt.names.seams, UnorderedElementsAre("side left", "side right"));
  EXPECT_THAT(skirt.names.openings, UnorderedElementsAre("waist", "hem"));
  const SewingPattern drafted = in_craft_order(draft_pattern(skirt.flat, skirt.names));
  EXPECT_EQ(drafted.panels[0].name, "front");
  EXPECT_EQ(drafted.panels[1].name, "back");
}

TEST(DraftPattern, CylinderInTwo_IsTwoRectangles) {
  const TwoPanels skirt;
  const SewingPattern drafted = draft_pattern(skirt.flat, skirt.names);
  ASSERT_NO_THROW(check_sewing_pattern(drafted));
  ASSERT_EQ(drafted.panels.size(), 2U);
  for (const Panel& panel : drafted.panels) {
    EXPECT_EQ(panel.edges.size(), 4U);
    std::multiset<std::string> names;
    for (const PanelEdge& edge : panel.edges) {
      EXPECT_TRUE(is_straight(edge));
      names.insert(edge.name);
    }
    EXPECT_THAT(names, UnorderedElementsAre("", "", "hem", "waist"));
    EXPECT_NEAR(panel_area(panel), 0.6 * 32 * 0.2 * std::sin(std::numbers::pi / 32), 1e-3);
  }
  EXPECT_EQ(drafted.seams.size(), 2U);
  EXPECT_LT(seam_mismatch(drafted), 1e-6);
}

/// Zigzag along the triangles of a sphere: sides differ, and are equal as they are drawn.
TEST(DraftPattern, JaggedSides_AreDrawnSmoothAndEqual) {
  Mesh mesh = fixtures::sphere(3);
  mesh.vertices *= 0.3;
  const FlatPattern flat = flatten_surface(mesh, opened(mesh));
  const SewingPattern drafted = draft_pattern(flat, own_names(flat));
  EXPECT_LT(seam_mismatch(drafted), 0.003);
  std::size_t edges = 0;
  for (const Panel& panel : drafted.panels) {
    edges += panel.edges.size();
  }
  std::size_t segments = 0;
  for (const FlatSeam& seam : flat.seams) {
    segments += 2 * (seam.a.size() - 1);
  }
  EXPECT_LE(edges, segments);
}

/// A drafted dress that is bent round a body, flat and drawn again.
SewingPattern dress_again() {
  const Garment garment = garment_from_pattern(dress_pattern({}), {.edge_length = 0.03});
  FlatPattern flat =
      flatten_surface(garment.mesh, fixtures::no_cut(fixtures::topology(garment.mesh)));
  flat.panel_names = garment.panel_names;
  return draft_pattern(flat, own_names(flat));
}

TEST(DraftPattern, DraftedDress_HasItsAreaAndFewEdges) {
  const SewingPattern truth = dress_pattern({});
  const SewingPattern drafted = dress_again();
  ASSERT_EQ(drafted.panels.size(), truth.panels.size());
  for (std::size_t p = 0; p < truth.panels.size(); ++p) {
    EXPECT_EQ(drafted.panels[p].name, truth.panels[p].name);
    EXPECT_NEAR(panel_area(drafted.panels[p]) / panel_area(truth.panels[p]), 1, 0.01);
    EXPECT_LE(drafted.panels[p].edges.size(), 2 * truth.panels[p].edges.size() + 2)
        << drafted.panels[p].name;
  }
}

TEST(GarmentPatternText, WrittenPattern_IsReadAgain) {
  const TwoPanels skirt;
  SewingPattern drafted = draft_pattern(skirt.flat, skirt.names);
  place_on_surface(drafted, skirt.mesh, skirt.flat);
  const SewingPattern again =
      garment_pattern_from_json(garment_pattern_text(drafted), "pattern.json");
  ASSERT_EQ(again.panels.size(), drafted.panels.size());
  EXPECT_EQ(again.seams.size(), drafted.seams.size());
  for (const Panel& panel : drafted.panels) {
    const auto same = std::find_if(again.panels.begin(), again.panels.end(),
                                   [&](const Panel& other) { return other.name == panel.name; });
    ASSERT_NE(same, again.panels.end());
    EXPECT_NEAR(panel_area(*same), panel_area(panel), 1e-9);
    for (Index i = 0; i < panel.corners.rows(); ++i) {
      EXPECT_LT((place(same->placement, same->corners.row(i).transpose()) -
                 place(panel.placement, panel.corners.row(i).transpose()))
                    .norm(),
                1e-6);
    }
  }
  // Arcs and cubics, too.
  const SewingPattern dress = dress_pattern({});
  const SewingPattern dress_read = garment_pattern_from_json(garment_pattern_text(dress), "dress");
  double area = 0;
  double area_read = 0;
  for (std::size_t p = 0; p < dress.panels.size(); ++p) {
    area += panel_area(dress.panels[p]);
    area_read += panel_area(dress_read.panels[p]);
  }
  EXPECT_NEAR(area_read, area, 1e-9);
}

TEST(GarmentPatternText, PanelsOfAWearerElsewhere_AreNotTurnedOver) {
  // Behind the origin most of the cloth looks towards it, which reads as inside out.
  SewingPattern skirt;
  for (const bool front : {true, false}) {
    Panel panel;
    panel.name = front ? "front" : "back";
    const double width = front ? 0.6 : 0.4;
    panel.corners.resize(4, 2);
    panel.corners << 0, 0, width, 0.1, width, 0.5, 0, 0.5;
    for (int i = 0; i < 4; ++i) {
      panel.edges.push_back({i, (i + 1) % 4, {}, "", 0});
    }
    panel.placement.origin = {front ? -0.3 : 0.2, 0, front ? -0.8 : -1.2};
    panel.placement.rotation = {0, front ? 0 : std::numbers::pi, 0};
    skirt.panels.push_back(panel);
  }
  skirt.seams = {{"side left", 0, 1, 1, 3, true}, {"side right", 0, 3, 1, 1, true}};
  const std::string text = garment_pattern_text(skirt);
  const SewingPattern again = garment_pattern_from_json(text, "pattern.json");
  for (const Panel& panel : again.panels) {
    const Panel& written = skirt.panels[panel.name == "front" ? 0 : 1];
    EXPECT_LT((panel.corners - written.corners).cwiseAbs().maxCoeff(), 1e-9) << panel.name;
  }
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    other.replace(other.find(from), from.size(), to);
    return other;
  };
  EXPECT_THROW(garment_pattern_from_json(with("\"counter-clockwise\"", "\"inside\""), "p.json"),
               DataError);
  // The same words over a loop that runs the other way contradict it.
  std::reverse(skirt.panels[0].edges.begin(), skirt.panels[0].edges.end());
  for (PanelEdge& edge : skirt.panels[0].edges) {
    std::swap(edge.start, edge.end);
  }
  EXPECT_THROW(garment_pattern_from_json(garment_pattern_text(skirt), "p.json"), DataError);
}

TEST(LayOutPieces, Hem_HasItsOwnAllowance) {
  const TwoPanels skirt;
  const PatternLayout layout = lay_out_pieces(draft_pattern(skirt.flat, skirt.names),
                                              {.seam_allowance = 0.01, .hem_allowance = 0.03});
  ASSERT_EQ(layout.pieces.size(), 2U);
  for (const PatternPiece& piece : layout.pieces) {
    const auto extent = [](const Points2& line, int axis) {
      return line.col(axis).maxCoeff() - line.col(axis).minCoeff();
    };
    EXPECT_NEAR(extent(piece.cut_line, 0) - extent(piece.sew_line, 0), 0.02, 1e-6);
    EXPECT_NEAR(extent(piece.cut_line, 1) - extent(piece.sew_line, 1), 0.04, 1e-6);
    EXPECT_TRUE(piece.fold.has_value()) << "a rectangle is its own mirror image";
    EXPECT_FALSE(piece.labels.empty());
  }
}

TEST(ExchangeDxf, BothDialects_SayMillimetres) {
  const TwoPanels skirt;
  const PatternLayout layout = lay_out_pieces(draft_pattern(skirt.flat, skirt.names));
  for (const DxfDialect dialect : {DxfDialect::Astm, DxfDialect::Aama}) {
    const std::string text = exchange_dxf(layout, "skirt", dialect);
    EXPECT_NE(text.find("  9\r\n$INSUNITS\r\n 70\r\n     4\r\n"), std::string::npos);
    EXPECT_NE(text.find("UNITS: METRIC"), std::string::npos);
    EXPECT_NE(text.find("CONTROL_SQUARE"), std::string::npos);
  }
}

TEST(ExchangeDxf, BothDialects_AreReadByEzdxfAtTrueSize) {
  if (std::system("/usr/bin/python3 -c 'import ezdxf' 2>/dev/null") != 0) {
    GTEST_SKIP() << "no ezdxf (package python3-ezdxf)";
  }
  const TwoPanels skirt;
  const PatternLayout layout = lay_out_pieces(draft_pattern(skirt.flat, skirt.names));
  const fixtures::TemporaryDirectory folder;
  for (const DxfDialect dialect : {DxfDialect::Astm, DxfDialect::Aama}) {
    std::ofstream(folder / "a.dxf") << exchange_dxf(layout, "skirt", dialect);
    std::ofstream(folder / "judge.py") << R"(import sys, ezdxf
drawing = ezdxf.readfile(sys.argv[1])
assert drawing.dxfversion == 'AC1009' and not drawing.audit().errors
assert drawing.header['$INSUNITS'] == 4
inserts = list(drawing.modelspace().query('INSERT'))
assert len(inserts) == 3, inserts
assert any(t.dxf.text == 'UNITS: METRIC' for t in drawing.modelspace().query('TEXT'))
square = drawing.blocks.get('CONTROL_SQUARE')
for block in map(drawing.blocks.get, [i.dxf.name for i in inserts]):
    lines = [l for l in block.query('POLYLINE') if l.dxf.layer == '1']
    assert len(lines) == 1 and lines[0].is_closed
    xs = [p[0] for p in lines[0].points()]
    assert len(set(map(tuple, lines[0].points()))) == len(lines[0]), 'last vertex repeated'
    if block.name == 'CONTROL_SQUARE':
        assert max(xs) - min(xs) == 100
    else:
        assert abs(max(xs) - min(xs) - float(sys.argv[2])) < 0.001, max(xs) - min(xs)
        layers = {e.dxf.layer for e in block}
        assert {'1', '2', '4', '6', '7', '14'} <= layers, layers
        assert ('84' in layers) == (sys.argv[3] == 'astm'), layers
        texts = [t.dxf.text for t in block.query('TEXT')]
        assert any(t.startswith('PIECE NAME: ') for t in texts)
        assert any(t.startswith('CATEGORY') for t in texts) == (sys.argv[3] == 'aama')
)";
    const Points2& cut = layout.pieces[0].cut_line;
    const fixtures::ChildResult result = fixtures::run_child(
        {"/usr/bin/python3", (folder / "judge.py").string(), (folder / "a.dxf").string(),
         std::to_string(1000 * (cut.col(0).maxCoeff() - cut.col(0).minCoeff())),
         dialect == DxfDialect::Astm ? "astm" : "aama"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
}

TEST(DraftPattern, NamesThatAreMissing_AreRefused) {
  const TwoPanels skirt;
  EXPECT_THROW(draft_pattern(skirt.flat, {}), LogicError);
}

}  // namespace
}  // namespace atelier
