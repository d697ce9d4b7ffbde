#include <set>

#include "registration/flattening/dxf_text.h"
#include "registration/flattening/pattern_pieces.h"

namespace atelier {
namespace {

// AAMA's layers (ASTM D6673).
constexpr const char* kCut = "1";
constexpr const char* kNotches = "4";
constexpr const char* kMirror = "6";
constexpr const char* kGrain = "7";
constexpr const char* kSew = "14";
constexpr const char* kAnnotation = "15";

constexpr double kTextHeight = 0.01;  // m
constexpr double kUnder = -0.03;      // m, the first line of text under the fabric
constexpr double kLine = 0.02;        // m, between lines

/// The control square's lower left corner.
Eigen::Vector2d control_corner() {
  return {0, kUnder - 2 * kLine - kControlSquare};
}

/// Smallest and largest corner of everything drawn, texts by their first letter. Rows.
Points2 extents(const PatternLayout& layout) {
  Points2 box(2, 2);
  box.row(0) = control_corner();
  box.row(1) = Eigen::RowVector2d(kControlSquare, kUnder + kTextHeight);
  for (const PatternPiece& piece : layout.pieces) {
    for (const Points2* line : {&piece.cut_line, &piece.sew_line}) {
      if (line->rows() > 0) {
        box.row(0) = box.row(0).cwiseMin(line->colwise().minCoeff());
        box.row(1) = box.row(1).cwiseMax(line->colwise().maxCoeff());
      }
    }
  }
  return box;
}

void header(DxfText& dxf, const PatternLayout& layout) {
  const Points2 box = extents(layout);
  dxf.pair(0, "SECTION");
  dxf.pair(2, "HEADER");
  dxf.pair(9, "$ACADVER");
  dxf.pair(1, "AC1009");
  dxf.units();
  dxf.pair(9, "$EXTMIN");
  dxf.point(10, box.row(0).transpose());
  dxf.pair(9, "$EXTMAX");
  dxf.point(10, box.row(1).transpose());
  dxf.pair(0, "ENDSEC");
}

void layers(DxfText& dxf) {
  dxf.pair(0, "SECTION");
  dxf.pair(2, "TABLES");
  dxf.pair(0, "TABLE");
  dxf.pair(2, "LTYPE");
  dxf.integer(70, 1);
  dxf.pair(0, "LTYPE");
  dxf.pair(2, "CONTINUOUS");
  dxf.integer(70, 0);
  dxf.pair(3, "Solid line");
  dxf.integer(72, 65);
  dxf.integer(73, 0);
  dxf.number(40, 0);
  dxf.pair(0, "ENDTAB");
  dxf.pair(0, "TABLE");
  dxf.pair(2, "LAYER");
  dxf.integer(70, 7);
  const std::pair<const char*, int> colors_of_layers[] = {
      {"0", 7}, {kCut, 7}, {kNotches, 1}, {kMirror, 6}, {kGrain, 8}, {kSew, 5}, {kAnnotation, 3}};
  for (const auto& [name, color] : colors_of_layers) {
    dxf.pair(0, "LAYER");
    dxf.pair(2, name);
    dxf.integer(70, 0);
    dxf.integer(62, color);
    dxf.pair(6, "CONTINUOUS");
  }
  dxf.pair(0, "ENDTAB");
  dxf.pair(0, "ENDSEC");
}

void block(DxfText& dxf, const PatternPiece& piece, const std::string& name) {
  dxf.block(name, "0");
  dxf.pair(3, name);
  dxf.polyline(piece.cut_line, true, kCut);
  dxf.polyline(piece.sew_line, true, kSew);
  dxf.line(piece.grain_from, piece.grain_to, kGrain);
  if (piece.fold) {
    dxf.line(piece.fold->first, piece.fold->second, kMirror);
  }
  for (const Notch& notch : piece.notches) {
    dxf.line(notch.position, notch.position + kNotchLength * notch.outwards, kNotches);
  }
  const Eigen::Vector2d middle = (piece.grain_from + piece.grain_to) / 2;
  dxf.label("PIECE NAME: " + dxf_plain(piece.name), middle, kTextHeight, kAnnotation);
  dxf.label("QUANTITY: 1", middle - Eigen::Vector2d(0, 0.015), kTextHeight, kAnnotation);
  dxf.label("ANNOTATION: UNIT MM", middle - Eigen::Vector2d(0, 0.03), kTextHeight, kAnnotation);
  dxf.entity("ENDBLK", "0");
}

}  // namespace

std::string pattern_dxf(const PatternLayout& layout, const std::string& title) {
  DxfText dxf;
  header(dxf, layout);
  layers(dxf);
  std::set<std::string> taken;
  std::vector<std::string> names;
  dxf.pair(0, "SECTION");
  dxf.pair(2, "BLOCKS");
  for (const PatternPiece& piece : layout.pieces) {
    names.push_back(dxf_block_name(piece.name, taken));
    block(dxf, piece, names.back());
  }
  dxf.pair(0, "ENDSEC");
  dxf.pair(0, "SECTION");
  dxf.pair(2, "ENTITIES");
  for (const std::string& name : names) {
    dxf.insert(name, kCut);
  }
  dxf.label("STYLE NAME: " + dxf_plain(title), {0, kUnder}, kTextHeight, kAnnotation);
  dxf.label("UNITS: METRIC", {0, kUnder - kLine}, kTextHeight, kAnnotation);
  dxf.polyline(control_square(control_corner().transpose()), true, kAnnotation);
  dxf.label("CONTROL SQUARE: 100 MM", control_corner() + Eigen::Vector2d(0.005, 0.005), kTextHeight,
            kAnnotation);
  dxf.pair(0, "ENDSEC");
  dxf.pair(0, "EOF");
  return dxf.take();
}

}  // namespace atelier
