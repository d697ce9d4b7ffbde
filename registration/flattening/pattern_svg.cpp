#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include "registration/flattening/pattern_pieces.h"

namespace atelier {
namespace {

constexpr double kUnits = 1000;   // to a metre
constexpr double kMargin = 0.02;  // m round the fabric
constexpr double kSquare = 0.1;   // m, the test square

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += static_cast<unsigned char>(c) < 32 ? ' ' : c;
    }
  }
  return result;
}

/// Millimetres to a micrometre, with no locale.
std::string number(double millimetres) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3f", millimetres);
  std::string result = text;
  for (char& c : result) {
    c = c == ',' ? '.' : c;
  }
  return result == "-0.000" ? "0.000" : result;
}

class Svg {
 public:
  explicit Svg(double height) : height_(height) {}

  /// SVG's y runs down.
  std::string point(const Eigen::Vector2d& p) const {
    return number((p.x() + kMargin) * kUnits) + "," + number((height_ - kMargin - p.y()) * kUnits);
  }
  std::string x(double value) const { return number((value + kMargin) * kUnits); }
  std::string y(double value) const { return number((height_ - kMargin - value) * kUnits); }

  std::string path(const Points2& line, bool closed, const std::string& id) const {
    std::string text = "<path";
    if (!id.empty()) {
      text += " id=\"" + escaped(id) + "\"";
    }
    text += " d=\"M";
    for (Index i = 0; i < line.rows(); ++i) {
      text += (i == 0 ? " " : " L ") + point(line.row(i).transpose());
    }
    return text + (closed ? " Z" : "") + "\"/>\n";
  }

 private:
  double height_;
};

Points2 line_of(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  Points2 line(2, 2);
  line << a.transpose(), b.transpose();
  return line;
}

}  // namespace

std::string pattern_svg(const PatternLayout& layout, const std::string& title) {
  const double width = layout.width + 2 * kMargin;
  const double height = layout.length + kSquare + 3 * kMargin;
  const Svg svg(height);
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  text +=
      "<svg xmlns=\"http://www.w3.org/2000/svg\" "
      "xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" version=\"1.1\" width=\"" +
      number(width * kUnits) + "mm\" height=\"" + number(height * kUnits) + "mm\" viewBox=\"0 0 " +
      number(width * kUnits) + " " + number(height * kUnits) + "\">\n";
  text += "<title>" + escaped(title) + "</title>\n";
  text += "<desc>Sewing pattern at true scale: one user unit is one millimetre.</desc>\n";
  const auto layer = [&](const char* name, const char* style,
                         const std::function<void(const PatternPiece&)>& each) {
    text += std::string("<g id=\"layer-") + name +
            "\" inkscape:groupmode=\"layer\" inkscape:label=\"" + name + "\" " + style + ">\n";
    for (const PatternPiece& piece : layout.pieces) {
      each(piece);
    }
    text += "</g>\n";
  };
  layer("cut", R"(fill="#f4f1ea" stroke="#000000" stroke-width="0.6")",
        [&](const PatternPiece& p) { text += svg.path(p.cut_line, true, "cut-" + p.name); });
  layer("sew", R"(fill="none" stroke="#1f5fbf" stroke-width="0.4" stroke-dasharray="4 2")",
        [&](const PatternPiece& p) { text += svg.path(p.sew_line, true, "sew-" + p.name); });
  layer("grain", R"(fill="none" stroke="#808080" stroke-width="0.5")", [&](const PatternPiece& p) {
    text += svg.path(line_of(p.grain_from, p.grain_to), false, "grain-" + p.name);
    const Eigen::Vector2d along = (p.grain_to - p.grain_from).normalized();
    const Eigen::Vector2d across(along.y(), -along.x());
    Points2 head(3, 2);
    head << (p.grain_to - 0.012 * along + 0.005 * across).transpose(), p.grain_to.transpose(),
        (p.grain_to - 0.012 * along - 0.005 * across).transpose();
    text += svg.path(head, false, "");
  });
  layer("fold", R"(fill="none" stroke="#208040" stroke-width="0.4" stroke-dasharray="8 2 2 2")",
        [&](const PatternPiece& p) {
          if (p.fold) {
            text += svg.path(line_of(p.fold->first, p.fold->second), false, "fold-" + p.name);
          }
        });
  layer("notches", R"(fill="none" stroke="#c02020" stroke-width="0.5")",
        [&](const PatternPiece& p) {
          for (const Notch& notch : p.notches) {
            text += svg.path(
                line_of(notch.position, notch.position + kNotchLength * notch.outwards), false, "");
          }
        });
  layer("text", R"(fill="#000000" font-family="sans-serif" font-size="14" text-anchor="middle")",
        [&](const PatternPiece& p) {
          const Eigen::Vector2d at = (p.grain_from + p.grain_to) / 2;
          text += "<text x=\"" + svg.x(at.x()) + "\" y=\"" + svg.y(at.y()) + "\">" +
                  escaped(p.name) + "</text>\n";
        });
  layer("names", R"(fill="#1f5fbf" font-family="sans-serif" font-size="5" text-anchor="middle")",
        [&](const PatternPiece& p) {
          for (const EdgeLabel& label : p.labels) {
            // Upright for who reads from below or from the right.
            double degrees = -std::atan2(label.along.y(), label.along.x()) * 180 / std::numbers::pi;
            degrees += degrees > 90 ? -180 : degrees <= -90 ? 180 : 0;
            const std::string x = svg.x(label.position.x());
            const std::string y = svg.y(label.position.y());
            text += "<text x=\"" + x + "\" y=\"" + y + "\" transform=\"rotate(" + number(degrees) +
                    " " + x + " " + y + ")\">" + escaped(label.text) + "</text>\n";
          }
        });
  Points2 square(4, 2);
  const double base = layout.length + kMargin;
  square << 0, base, kSquare, base, kSquare, base + kSquare, 0, base + kSquare;
  text += R"(<g id="layer-scale" inkscape:groupmode="layer" inkscape:label="scale" fill="none" )"
          R"(stroke="#000000" stroke-width="0.3">)"
          "\n" +
          svg.path(square, true, "square-100mm");
  text += "<text x=\"" + svg.x(kSquare / 2) + "\" y=\"" + svg.y(base + kSquare / 2) +
          "\" fill=\"#000000\" stroke=\"none\" font-family=\"sans-serif\" font-size=\"10\" "
          "text-anchor=\"middle\">100 mm</text>\n</g>\n</svg>\n";
  return text;
}

}  // namespace atelier
