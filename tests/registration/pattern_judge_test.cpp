// Outside judges of patterns: what dxf-parser (npm) and ezdxf (Debian) find in our DXF.

#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "registration/flattening/pattern_pieces.h"
#include "tests/support/outside_judge.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::ElementsAre;

/// Two rectangles side by side, the second a hand's width up.
PatternLayout two_rectangles() {
  PatternLayout layout;
  layout.width = 1.5;
  layout.length = 0.8;
  for (int i = 0; i < 2; ++i) {
    PatternPiece piece;
    piece.name = i == 0 ? "front" : "back";
    const double x = 0.5 * i;
    const double y = 0.1 * i;
    piece.sew_line.resize(4, 2);
    piece.sew_line << x + 0.01, y + 0.01, x + 0.39, y + 0.01, x + 0.39, y + 0.59, x + 0.01,
        y + 0.59;
    piece.cut_line.resize(4, 2);
    piece.cut_line << x, y, x + 0.4, y, x + 0.4, y + 0.6, x, y + 0.6;
    piece.grain_from = {x + 0.2, y + 0.1};
    piece.grain_to = {x + 0.2, y + 0.5};
    layout.pieces.push_back(piece);
  }
  return layout;
}

TEST(PatternJudge, DxfParser_FindsUnitExtentsAndControlSquare) {
  ATELIER_NEEDS_JUDGE("dxf-parser");
  const fixtures::TemporaryDirectory folder;
  std::ofstream(folder / "a.dxf") << pattern_dxf(two_rectangles(), "dress");
  const fixtures::Judgement found =
      fixtures::judged("dxf_parser.mjs", {(folder / "a.dxf").string()});
  EXPECT_THAT(found.at("unit"), ElementsAre(4)) << "millimetres";
  EXPECT_THAT(found.at("$EXTMAX"), ElementsAre(900, 700));
  EXPECT_THAT(found.at("FRONT:1"), ElementsAre(0, 0, 400, 600));
  EXPECT_THAT(found.at("BACK:14"), ElementsAre(510, 110, 890, 690));
  const std::vector<double>& square = found.at("drawing:15");
  ASSERT_EQ(square.size(), 4U);
  EXPECT_EQ(square[2] - square[0], 100);
  EXPECT_EQ(square[3] - square[1], 100);
  EXPECT_LT(square[3], 0) << "under the fabric";
  EXPECT_THAT(found.at("$EXTMIN"), ElementsAre(square[0], square[1]));
}

TEST(PatternJudge, Ezdxf_FindsWhatTheHeaderSays) {
  if (std::system("/usr/bin/python3 -c 'import ezdxf' 2>/dev/null") != 0) {
    GTEST_SKIP() << "no ezdxf (package python3-ezdxf)";
  }
  const fixtures::TemporaryDirectory folder;
  std::ofstream(folder / "a.dxf") << pattern_dxf(two_rectangles(), "dress");
  std::ofstream(folder / "judge.py") << R"(import sys, ezdxf
drawing = ezdxf.readfile(sys.argv[1])
assert not drawing.audit().errors
assert drawing.header['$INSUNITS'] == 4
space = drawing.modelspace()
lines = [line for insert in space.query('INSERT') for line in insert.virtual_entities()
         if line.dxftype() == 'POLYLINE'] + list(space.query('POLYLINE'))
assert len(lines) == 5, lines
assert not drawing.query('SPLINE') and all(line.is_closed for line in lines)
points = [point for line in lines for point in line.points()]
low = [min(p[axis] for p in points) for axis in range(2)]
high = [max(p[axis] for p in points) for axis in range(2)]
assert low == list(drawing.header['$EXTMIN'][:2]), (low, drawing.header['$EXTMIN'])
assert high == list(drawing.header['$EXTMAX'][:2]), (high, drawing.header['$EXTMAX'])
)";
  const fixtures::ChildResult result = fixtures::run_child(
      {"/usr/bin/python3", (folder / "judge.py").string(), (folder / "a.dxf").string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

}  // namespace
}  // namespace atelier
