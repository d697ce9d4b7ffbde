#include "registration/drafting/pattern_pdf.h"

#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

/// A rectangle of 300 x 500 mm, 100 mm from the left: three columns, of which the first has
/// something, and two rows.
PatternLayout one_rectangle() {
  PatternLayout layout;
  layout.width = 1.5;
  layout.length = 0.5;
  PatternPiece piece;
  piece.name = "front (left)";
  piece.cut_line.resize(4, 2);
  piece.cut_line << 0.1, 0, 0.4, 0, 0.4, 0.5, 0.1, 0.5;
  piece.sew_line.resize(4, 2);
  piece.sew_line << 0.11, 0.01, 0.39, 0.01, 0.39, 0.49, 0.11, 0.49;
  piece.grain_from = {0.25, 0.1};
  piece.grain_to = {0.25, 0.4};
  layout.pieces.push_back(piece);
  return layout;
}

TEST(PatternPdf, PagesWithoutAPiece_AreLeftOut) {
  const std::string pdf = pattern_pdf(one_rectangle(), "dress");
  EXPECT_THAT(pdf, HasSubstr("/Count 6 ")) << "three of eight columns, two rows";
  EXPECT_THAT(pdf, HasSubstr("front \\(left\\)"));
  EXPECT_EQ(pdf, pattern_pdf(one_rectangle(), "dress"));
}

TEST(PatternPdf, PatternOfAThousandKilometres_HasOnePageThatSaysSo) {
  PatternLayout layout = one_rectangle();
  layout.width = layout.length = 1e6;
  layout.pieces[0].cut_line *= 2e6;
  const std::string pdf = pattern_pdf(layout, "dress");
  EXPECT_THAT(pdf, HasSubstr("/Count 1 "));
  EXPECT_THAT(pdf, HasSubstr("too large for pages"));
}

TEST(PatternPdf, Poppler_FindsPagesOfA4AtTrueScale) {
  if (std::system("command -v pdfinfo >/dev/null && command -v pdftoppm >/dev/null") != 0) {
    GTEST_SKIP() << "no pdfinfo, pdftoppm (package poppler-utils)";
  }
  const fixtures::TemporaryDirectory folder;
  const std::string file = (folder / "a.pdf").string();
  std::ofstream(file, std::ios::binary) << pattern_pdf(one_rectangle(), "dress");
  const fixtures::ChildResult info = fixtures::run_child({"pdfinfo", file});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_EQ(info.err, "");
  EXPECT_THAT(info.out, HasSubstr("A4"));
  EXPECT_THAT(info.out, HasSubstr("Pages:           6"));
  // At 254 dots an inch ten dots are a millimetre: the left edge of the piece lies at 10 + 100 mm.
  std::ofstream(folder / "judge.py") << R"(import subprocess, sys
subprocess.run(['pdftoppm', '-gray', '-r', '254', '-f', '1', '-l', '1', '-singlefile',
                sys.argv[1], sys.argv[2]], check=True)
data = open(sys.argv[2] + '.pgm', 'rb').read()
kind, size, most, pixels = data.split(b'\n', 3)
width, height = map(int, size.split())
assert abs(width - 2100) <= 1 and abs(height - 2970) <= 1, (width, height)  # rounded up
row = pixels[1000 * width:1001 * width]
dark = [x for x in range(width) if row[x] < 128]
assert any(abs(x - 1100) <= 3 for x in dark), dark
)";
  const fixtures::ChildResult judged = fixtures::run_child(
      {"/usr/bin/python3", (folder / "judge.py").string(), file, (folder / "page").string()});
  EXPECT_EQ(judged.exit_code, 0) << judged.err;
}

}  // namespace
}  // namespace atelier
