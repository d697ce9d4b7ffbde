#include "registration/drafting/exchange_dxf.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "core/cross.h"
#include "registration/flattening/dxf_text.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;

constexpr const char* kBoundary = "1";
constexpr const char* kTurnPoints = "2";
constexpr const char* kCurvePoints = "3";
constexpr const char* kNotchPoints = "4";
constexpr const char* kMirrorLine = "6";
constexpr const char* kGrainLine = "7";
constexpr const char* kSewLine = "14";
constexpr const char* kBoundaryQuality = "84";
constexpr const char* kSewQuality = "87";
constexpr double kLetters = 0.006;  // m

/// Where a notch's direction meets the boundary; the notch itself where it does not.
Vector2 on_boundary(const Points2& boundary, const Notch& notch) {
  double nearest = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < boundary.rows(); ++i) {
    const Vector2 a = boundary.row(i);
    const Vector2 ab = Vector2(boundary.row((i + 1) % boundary.rows())) - a;
    const double across = cross(notch.outwards, ab);
    if (across == 0) {
      continue;
    }
    const double along = cross(a - notch.position, ab) / across;
    const double t = cross(a - notch.position, notch.outwards) / across;
    if (along >= 0 && t >= 0 && t <= 1) {
      nearest = std::min(nearest, along);
    }
  }
  return std::isfinite(nearest) ? Vector2(notch.position + nearest * notch.outwards)
                                : notch.position;
}

/// A POINT on every vertex: turn points where the line turns, curve points between them.
void points_of_line(DxfText& dxf, const Points2& line) {
  constexpr double kTurn = 0.2;  // rad; curves are drawn in steps of 4 mm
  const Index count = line.rows();
  for (Index i = 0; i < count; ++i) {
    const Vector2 in = line.row(i) - line.row((i + count - 1) % count);
    const Vector2 out = line.row((i + 1) % count) - line.row(i);
    const bool turns = std::abs(std::atan2(cross(in, out), in.dot(out))) > kTurn;
    dxf.entity("POINT", turns ? kTurnPoints : kCurvePoints);
    dxf.point(10, line.row(i).transpose());
  }
}

void texts_of_piece(DxfText& dxf, const std::string& name, const Vector2& at, DxfDialect dialect) {
  int line = 0;
  const auto text = [&](const std::string& value) {
    dxf.label(value, at - Vector2(0, 1.5 * kLetters * line++), kLetters, kBoundary);
  };
  text("PIECE NAME: " + name);
  text("SIZE: ONE");
  text("QUANTITY: 1");
  text("MATERIAL: CLOTH");
  if (dialect == DxfDialect::Aama) {
    text("CATEGORY: CLOTH");
  }
  text("ANNOTATION: UNIT MM");
}

/// Readers cut names at 20 letters.
constexpr std::size_t kLongestName = 20;

void piece_block(DxfText& dxf, const PatternPiece& piece, const std::string& name,
                 DxfDialect dialect) {
  dxf.block(name, kBoundary);
  dxf.polyline(piece.cut_line, true, kBoundary);
  points_of_line(dxf, piece.cut_line);
  dxf.polyline(piece.sew_line, true, kSewLine);
  if (dialect == DxfDialect::Astm) {
    dxf.polyline(piece.cut_line, true, kBoundaryQuality);
    dxf.polyline(piece.sew_line, true, kSewQuality);
  }
  dxf.line(piece.grain_from, piece.grain_to, kGrainLine);
  if (piece.fold) {
    dxf.line(piece.fold->first, piece.fold->second, kMirrorLine);
  }
  for (const Notch& notch : piece.notches) {
    const Vector2 at = 1000 * on_boundary(piece.cut_line, notch);  // mm
    dxf.entity("POINT", kNotchPoints);
    dxf.number(10, at.x());
    dxf.number(20, at.y());
    dxf.number(30, 1000 * kNotchLength);  // depth
    dxf.number(39, 0);                    // width: a slit
    dxf.number(50, std::atan2(-notch.outwards.y(), -notch.outwards.x()) * 180 / std::numbers::pi);
  }
  texts_of_piece(dxf, dxf_plain(piece.name).substr(0, kLongestName),
                 (piece.grain_from + piece.grain_to) / 2, dialect);
  dxf.entity("ENDBLK", kBoundary);
}

void square_block(DxfText& dxf, const std::string& name, DxfDialect dialect) {
  const Eigen::RowVector2d corner(0, -2 * kControlSquare);
  dxf.block(name, kBoundary);
  const Points2 square = control_square(corner);
  dxf.polyline(square, true, kBoundary);
  points_of_line(dxf, square);
  if (dialect == DxfDialect::Astm) {
    dxf.polyline(square, true, kBoundaryQuality);
  }
  const Vector2 middle = square.colwise().mean();
  dxf.line(middle - Vector2(0, 0.03), middle + Vector2(0, 0.03), kGrainLine);
  texts_of_piece(dxf, "CONTROL 100 MM", middle - Vector2(0.04, 0), dialect);
  dxf.entity("ENDBLK", kBoundary);
}

}  // namespace

std::string exchange_dxf(const PatternLayout& layout, const std::string& title,
                         DxfDialect dialect) {
  DxfText dxf;
  dxf.pair(0, "SECTION");
  dxf.pair(2, "HEADER");
  dxf.units();
  dxf.pair(0, "ENDSEC");
  std::set<std::string> taken;
  std::vector<std::string> names;
  dxf.pair(0, "SECTION");
  dxf.pair(2, "BLOCKS");
  for (const PatternPiece& piece : layout.pieces) {
    names.push_back(dxf_block_name(piece.name, taken));
    piece_block(dxf, piece, names.back(), dialect);
  }
  names.push_back(dxf_block_name("CONTROL_SQUARE", taken));
  square_block(dxf, names.back(), dialect);
  dxf.pair(0, "ENDSEC");
  dxf.pair(0, "SECTION");
  dxf.pair(2, "ENTITIES");
  for (const std::string& name : names) {
    dxf.insert(name, kBoundary);
  }
  int line = 0;
  const auto text = [&](const std::string& value) {
    dxf.label(value, {0, -0.02 - 1.5 * kLetters * line++}, kLetters, kBoundary);
  };
  const bool astm = dialect == DxfDialect::Astm;
  text(astm ? "ASTM/D13 PROPOSAL 1 VERSION: D6673-10" : "ANSI/AAMA VERSION: 1.0.0");
  text("STYLE NAME: " + dxf_plain(title).substr(0, kLongestName));
  text("AUTHOR: ATELIER");
  text("SAMPLE SIZE: ONE");
  text("UNITS: METRIC");
  if (astm) {
    text("CURVE TOLERANCE: 0.1");
  }
  dxf.pair(0, "ENDSEC");
  dxf.pair(0, "EOF");
  return dxf.take();
}

}  // namespace atelier
