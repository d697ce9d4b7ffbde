#include "registration/drafting/pattern_pdf.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "core/saturating_cast.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;

// Millimetres.
constexpr double kPageWidth = 210;
constexpr double kPageHeight = 297;
constexpr double kPageMargin = 10;
constexpr double kTileWidth = kPageWidth - 2 * kPageMargin;
constexpr double kTileHeight = kPageHeight - 2 * kPageMargin;
constexpr double kTestSquare = 50;
constexpr double kPointsPerMillimetre = 72 / 25.4;  // to a millimetre
constexpr double kMostPages = 2000;                 // far more than a garment takes; our choice

std::string digits(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4f", value);
  std::string result = text;
  std::replace(result.begin(), result.end(), ',', '.');
  return result + " ";
}

std::string place_digits(const Vector2& metres) {
  return digits(1000 * metres.x()) + digits(1000 * metres.y());
}

std::string line_of_points(const Points2& line) {
  std::string text;
  for (Index i = 0; i < line.rows(); ++i) {
    text += place_digits(line.row(i)) + (i == 0 ? "m\n" : "l\n");
  }
  return text + "s\n";  // closed
}

std::string segment(const Vector2& a, const Vector2& b) {
  return place_digits(a) + "m " + place_digits(b) + "l S\n";
}

/// A string in parentheses.
std::string pdf_text(const std::string& text) {
  std::string result = "(";
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    if (c == '(' || c == ')' || c == '\\') {
      result += '\\';
    }
    result += u >= 32 && u < 127 ? c : '?';
  }
  return result + ")";
}

/// `millimetres` high, along a unit vector.
std::string written(const std::string& text, const Vector2& place, const Vector2& along,
                    double millimetres) {
  return "BT /F1 " + digits(millimetres) + "Tf " + digits(along.x()) + digits(along.y()) +
         digits(-along.y()) + digits(along.x()) + place_digits(place) + "Tm " + pdf_text(text) +
         " Tj ET\n";
}

/// All pieces, in millimetres from the layout's corner.
std::string drawn_pieces(const PatternLayout& layout) {
  std::string text;
  for (const PatternPiece& piece : layout.pieces) {
    text += "[] 0 d 0.5 w " + line_of_points(piece.cut_line);
    text += "[4 2] 0 d 0.3 w " + line_of_points(piece.sew_line) + "[] 0 d\n";
    text += segment(piece.grain_from, piece.grain_to);
    const Vector2 up = (piece.grain_to - piece.grain_from).normalized();
    const Vector2 across(up.y(), -up.x());
    for (const double side : {-1.0, 1.0}) {
      text += segment(piece.grain_to, piece.grain_to - 0.012 * up + side * 0.005 * across);
    }
    if (piece.fold) {
      text += "[8 2 2 2] 0 d " + segment(piece.fold->first, piece.fold->second) + "[] 0 d\n";
    }
    for (const Notch& notch : piece.notches) {
      text += segment(notch.position, notch.position + kNotchLength * notch.outwards);
    }
    for (const EdgeLabel& label : piece.labels) {
      text += written(label.text, label.position, label.along, 4);
    }
    text += written(piece.name, (piece.grain_from + piece.grain_to) / 2, {1, 0}, 10);
  }
  return text;
}

/// Whether some piece may lie on a tile.
bool is_drawn_on(const PatternLayout& layout, const Vector2& low) {
  const Vector2 high = low + Vector2(kTileWidth, kTileHeight) / 1000;
  return std::any_of(layout.pieces.begin(), layout.pieces.end(), [&](const PatternPiece& piece) {
    const Vector2 from = piece.cut_line.colwise().minCoeff();
    const Vector2 to = piece.cut_line.colwise().maxCoeff();
    return (from.array() < high.array()).all() && (to.array() > low.array()).all();
  });
}

std::string stream(const std::string& entries, const std::string& content) {
  return "<< " + entries + "/Length " + std::to_string(content.size()) + " >>\nstream\n" + content +
         "endstream";
}

std::string tile_content(int row, int column, bool first, const std::string& title) {
  const std::string box =
      digits(kPageMargin) + digits(kPageMargin) + digits(kTileWidth) + digits(kTileHeight) + "re ";
  std::string text =
      "q " + digits(kPointsPerMillimetre) + "0 0 " + digits(kPointsPerMillimetre) + "0 0 cm\n";
  text += "q " + box + "W n 1 0 0 1 " + digits(kPageMargin - column * kTileWidth) +
          digits(kPageMargin - row * kTileHeight) + "cm /X1 Do Q\n";
  text += "0.2 w " + box + "S\n";
  std::string letters;
  for (int r = row; r >= 0; r = r / 26 - 1) {
    letters.insert(letters.begin(), static_cast<char>('A' + r % 26));
  }
  text += written(letters + std::to_string(column + 1) + "  " + title, {0.012, 0.004}, {1, 0}, 4);
  if (first) {
    text += digits(kPageMargin + 5) + digits(kPageMargin + 5) + digits(kTestSquare) +
            digits(kTestSquare) + "re S\n" + written("50 mm", {0.017, 0.017}, {1, 0}, 4);
  }
  return text + "Q\n";
}

}  // namespace

std::string pattern_pdf(const PatternLayout& layout, const std::string& title) {
  const auto tiles = [](double metres, double tile) {
    return std::max(1, saturating_cast<int>(std::ceil(1000 * metres / tile - 1e-9)));
  };
  int columns = tiles(layout.width, kTileWidth);
  int rows = tiles(layout.length, kTileHeight);
  std::string heading = title;
  if (static_cast<double>(columns) * rows > kMostPages) {
    heading += " (too large for pages: " + std::to_string(columns) + " x " + std::to_string(rows) +
               " of them)";
    columns = rows = 1;
  }
  std::vector<std::string> objects{
      "<< /Type /Catalog /Pages 2 0 R >>", "",
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
      stream("/Type /XObject /Subtype /Form /BBox [0 0 " + digits(columns * kTileWidth) +
                 digits(rows * kTileHeight) + "] /Resources << /Font << /F1 3 0 R >> >> ",
             drawn_pieces(layout))};
  std::string pages;
  int count = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (count > 0 &&
          !is_drawn_on(layout, Vector2(column * kTileWidth, row * kTileHeight) / 1000)) {
        continue;
      }
      objects.push_back(stream("", tile_content(row, column, count == 0, heading)));
      objects.push_back("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 " +
                        digits(kPageWidth * kPointsPerMillimetre) +
                        digits(kPageHeight * kPointsPerMillimetre) + "] /Contents " +
                        std::to_string(objects.size()) +
                        " 0 R /Resources << /Font << /F1 3 0 R >> /XObject << /X1 4 0 R >> >> >>");
      pages += std::to_string(objects.size()) + " 0 R ";
      ++count;
    }
  }
  objects[1] = "<< /Type /Pages /Count " + std::to_string(count) + " /Kids [" + pages + "] >>";
  std::string pdf = "%PDF-1.4\n";
  std::string table;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    char entry[32];
    std::snprintf(entry, sizeof entry, "%010zu 00000 n \n", pdf.size());
    table += entry;
    pdf += std::to_string(i + 1) + " 0 obj\n" + objects[i] + "\nendobj\n";
  }
  const std::string size = std::to_string(objects.size() + 1);
  const std::string start = std::to_string(pdf.size());
  return pdf + "xref\n0 " + size + "\n0000000000 65535 f \n" + table + "trailer\n<< /Size " + size +
         " /Root 1 0 R >>\nstartxref\n" + start + "\n%%EOF\n";
}

}  // namespace atelier
