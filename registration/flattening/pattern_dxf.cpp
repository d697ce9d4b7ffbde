#include <algorithm>
#include <cctype>
#include <cstdio>
#include <set>

#include "registration/flattening/pattern_pieces.h"

namespace atelier {
namespace {

constexpr double kMillimetres = 1000;

// AAMA's layers (ASTM D6673).
constexpr const char* kCut = "1";
constexpr const char* kNotches = "4";
constexpr const char* kGrain = "7";
constexpr const char* kSew = "14";
constexpr const char* kAnnotation = "15";

/// Pairs of group code and value, a line each, as every DXF reader takes them.
class Dxf {
 public:
  void pair(int code, const std::string& value) {
    char text[16];
    std::snprintf(text, sizeof text, "%3d", code);
    text_ += std::string(text) + "\r\n" + value + "\r\n";
  }
  void number(int code, double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.6f", value);
    std::string digits = text;
    std::replace(digits.begin(), digits.end(), ',', '.');
    pair(code, digits == "-0.000000" ? "0.000000" : digits);
  }
  void integer(int code, int value) {
    char text[16];
    std::snprintf(text, sizeof text, "%6d", value);
    pair(code, text);
  }
  /// Millimetres.
  void point(int code, const Eigen::Vector2d& metres) {
    number(code, metres.x() * kMillimetres);
    number(code + 10, metres.y() * kMillimetres);
    number(code + 20, 0);
  }
  void entity(const char* type, const char* layer) {
    pair(0, type);
    pair(8, layer);
  }
  void polyline(const Points2& line, bool closed, const char* layer) {
    entity("POLYLINE", layer);
    integer(66, 1);
    point(10, {0, 0});
    integer(70, closed ? 1 : 0);
    for (Index i = 0; i < line.rows(); ++i) {
      entity("VERTEX", layer);
      point(10, line.row(i).transpose());
    }
    entity("SEQEND", layer);
  }
  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const char* layer) {
    entity("LINE", layer);
    point(10, a);
    point(11, b);
  }
  void label(const std::string& value, const Eigen::Vector2d& at, double height) {
    entity("TEXT", kAnnotation);
    point(10, at);
    number(40, height * kMillimetres);
    pair(1, value);
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

/// R12 names are letters, digits, "-", "_" and "$", at most 31; each once.
std::string block_name(const std::string& name, std::set<std::string>& taken) {
  std::string block;
  for (const char c : name.substr(0, 24)) {
    const auto u = static_cast<unsigned char>(c);
    block += u < 128 && std::isalnum(u) != 0 ? static_cast<char>(std::toupper(u)) : '_';
  }
  block = block.empty() ? "PIECE" : block;
  std::string unique = block;
  for (int i = 2; !taken.insert(unique).second; ++i) {
    unique = block + "-" + std::to_string(i);
  }
  return unique;
}

/// One line of plain ASCII.
std::string plain(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    result += u >= 32 && u < 127 ? c : '?';
  }
  return result;
}

/// Of the control square, so that whoever opens the drawing can measure its unit: programs take
/// $INSUNITS, the text UNITS or neither.
constexpr double kControlSquare = 0.1;  // m
constexpr double kTextHeight = 0.01;    // m
constexpr double kUnder = -0.03;        // m, the first line of text under the fabric
constexpr double kLine = 0.02;          // m, between lines

/// The control square's lower left corner.
Eigen::Vector2d control_corner() {
  return {0, kUnder - 2 * kLine - kControlSquare};
}

Points2 control_square() {
  const Eigen::RowVector2d at = control_corner();
  Points2 square(4, 2);
  square << at, at + Eigen::RowVector2d(kControlSquare, 0),
      at + Eigen::RowVector2d(kControlSquare, kControlSquare),
      at + Eigen::RowVector2d(0, kControlSquare);
  return square;
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

void header(Dxf& dxf, const PatternLayout& layout) {
  const Points2 box = extents(layout);
  dxf.pair(0, "SECTION");
  dxf.pair(2, "HEADER");
  dxf.pair(9, "$ACADVER");
  dxf.pair(1, "AC1009");
  dxf.pair(9, "$MEASUREMENT");  // metric: hatch and line types of R12 readers
  dxf.integer(70, 1);
  dxf.pair(9, "$INSUNITS");  // millimetres, for readers of later versions
  dxf.integer(70, 4);
  dxf.pair(9, "$EXTMIN");
  dxf.point(10, box.row(0).transpose());
  dxf.pair(9, "$EXTMAX");
  dxf.point(10, box.row(1).transpose());
  dxf.pair(0, "ENDSEC");
}

void layers(Dxf& dxf) {
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
  dxf.integer(70, 6);
  const std::pair<const char*, int> kLayers[] = {{"0", 7},    {kCut, 7}, {kNotches, 1},
                                                 {kGrain, 8}, {kSew, 5}, {kAnnotation, 3}};
  for (const auto& [name, color] : kLayers) {
    dxf.pair(0, "LAYER");
    dxf.pair(2, name);
    dxf.integer(70, 0);
    dxf.integer(62, color);
    dxf.pair(6, "CONTINUOUS");
  }
  dxf.pair(0, "ENDTAB");
  dxf.pair(0, "ENDSEC");
}

void block(Dxf& dxf, const PatternPiece& piece, const std::string& name) {
  dxf.entity("BLOCK", "0");
  dxf.pair(2, name);
  dxf.integer(70, 0);
  dxf.point(10, {0, 0});
  dxf.pair(3, name);
  dxf.polyline(piece.cut_line, true, kCut);
  dxf.polyline(piece.sew_line, true, kSew);
  dxf.line(piece.grain_from, piece.grain_to, kGrain);
  for (const Notch& notch : piece.notches) {
    dxf.line(notch.position, notch.position + kNotchLength * notch.outwards, kNotches);
  }
  const Eigen::Vector2d middle = (piece.grain_from + piece.grain_to) / 2;
  dxf.label("PIECE NAME: " + plain(piece.name), middle, kTextHeight);
  dxf.label("QUANTITY: 1", middle - Eigen::Vector2d(0, 0.015), kTextHeight);
  dxf.label("ANNOTATION: UNIT MM", middle - Eigen::Vector2d(0, 0.03), kTextHeight);
  dxf.entity("ENDBLK", "0");
}

}  // namespace

std::string pattern_dxf(const PatternLayout& layout, const std::string& title) {
  Dxf dxf;
  header(dxf, layout);
  layers(dxf);
  std::set<std::string> taken;
  std::vector<std::string> names;
  dxf.pair(0, "SECTION");
  dxf.pair(2, "BLOCKS");
  for (const PatternPiece& piece : layout.pieces) {
    names.push_back(block_name(piece.name, taken));
    block(dxf, piece, names.back());
  }
  dxf.pair(0, "ENDSEC");
  dxf.pair(0, "SECTION");
  dxf.pair(2, "ENTITIES");
  for (const std::string& name : names) {
    dxf.entity("INSERT", kCut);
    dxf.pair(2, name);
    dxf.point(10, {0, 0});
  }
  dxf.label("STYLE NAME: " + plain(title), {0, kUnder}, kTextHeight);
  dxf.label("UNITS: METRIC", {0, kUnder - kLine}, kTextHeight);
  dxf.polyline(control_square(), true, kAnnotation);
  dxf.label("CONTROL SQUARE: 100 MM", control_corner() + Eigen::Vector2d(0.005, 0.005),
            kTextHeight);
  dxf.pair(0, "ENDSEC");
  dxf.pair(0, "EOF");
  return dxf.take();
}

}  // namespace atelier
