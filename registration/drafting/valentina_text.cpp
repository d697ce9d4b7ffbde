#include "registration/drafting/valentina_text.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/saturating_cast.h"
#include "registration/outlines/outline_measures.h"

namespace atelier {
namespace {

using Place = std::complex<double>;  // m

Place place_of(const Eigen::Vector2d& point) {
  return {point.x(), point.y()};
}

/// A part of an outline: a line, or a cubic with its control points.
struct OutlinePart {
  Place start;
  bool curved = false;
  Place first, second;  ///< control points of a cubic
  bool hem = false;
};

void add_arc(std::vector<OutlinePart>& parts, const Place& a, const Place& b, double bulge,
             bool hem) {
  constexpr double kMostTurn = std::numbers::pi / 4;
  const double turn = 4 * std::atan(bulge);
  const Place center = (a + b) / 2.0 + (1 - bulge * bulge) / (4 * bulge) * (b - a) * Place(0, 1);
  const int count = std::max(1, saturating_cast<int>(std::ceil(std::abs(turn) / kMostTurn)));
  const Place handle(0, 4.0 / 3 * std::tan(turn / count / 4));
  Place from = a;
  for (int i = 1; i <= count; ++i) {
    const Place to = i < count ? center + (a - center) * std::polar(1.0, turn * i / count) : b;
    parts.push_back(
        {from, true, from + handle * (from - center), to - handle * (to - center), hem});
    from = to;
  }
}

std::vector<OutlinePart> outline_parts(const Panel& panel) {
  std::vector<OutlinePart> parts;
  for (const PanelEdge& edge : panel.edges) {
    const Place a = place_of(panel.corners.row(edge.start));
    const Place b = place_of(panel.corners.row(edge.end));
    const bool hem = is_hem(edge);
    if (edge.bulge != 0) {
      add_arc(parts, a, b, edge.bulge, hem);
    } else if (edge.controls.empty()) {
      parts.push_back({a, false, {}, {}, hem});
    } else {
      const Place first = place_of(edge.controls.front());
      const Place second = place_of(edge.controls.back());
      const bool quadratic = edge.controls.size() == 1;
      parts.push_back({a, true, quadratic ? a + 2.0 / 3 * (first - a) : first,
                       quadratic ? b + 2.0 / 3 * (first - b) : second, hem});
    }
  }
  return parts;
}

/// The motion of the plane that laid a panel out: z -> turn * z + shift.
struct LaidOut {
  Place turn, shift;
  Place operator()(const Place& z) const { return turn * z + shift; }
};

LaidOut laid_out(const Panel& panel, const PatternPiece& piece) {
  const Points2 outline = panel_outline(panel);
  ATELIER_CHECK(outline.rows() == piece.sew_line.rows(), "the layout of this pattern");
  Index far = 0;
  (outline.rowwise() - outline.row(0)).rowwise().squaredNorm().maxCoeff(&far);
  const Place a = place_of(outline.row(0));
  const Place there = place_of(piece.sew_line.row(0));
  const Place turn = (place_of(piece.sew_line.row(far)) - there) / (place_of(outline.row(far)) - a);
  return {turn / std::abs(turn), there - turn / std::abs(turn) * a};
}

std::string xml_text(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
  }
  return safe;
}

std::string number_text(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.7f", value);
  return text;
}

std::string centimetres(double metres) {
  return number_text(100 * metres);
}

/// "A" to "Z", then "AA" and so on: names of points must not begin with a digit.
std::string letters_of(std::size_t panel) {
  std::string letters(1, static_cast<char>('A' + panel % 26));
  return panel < 26 ? letters : letters_of(panel / 26 - 1) + letters;
}

/// Writes one block. Valentina's objects have numbers that no other has.
class ValentinaBlock {
 public:
  ValentinaBlock(std::string letters, const Place& base, int& last_id)
      : letters_(std::move(letters)), base_(base), last_id_(last_id) {
    base_id_ = ++last_id_;
    // Down is positive on its screen; angles run counter-clockwise all the same.
    calculation_ += "   <point id=\"" + std::to_string(base_id_) + "\" type=\"single\" name=\"" +
                    letters_ + "0\" x=\"" + centimetres(base.real()) + "\" y=\"" +
                    centimetres(-base.imag()) + "\" mx=\"0.1\" my=\"0.1\"/>\n";
  }

  int point(const Place& at) {
    const Place off = at - base_;
    const int id = ++last_id_;
    const double degrees = std::arg(off) * 180 / std::numbers::pi;
    calculation_ += "   <point id=\"" + std::to_string(id) + "\" type=\"endLine\" name=\"" +
                    letters_ + std::to_string(++points_) + "\" basePoint=\"" +
                    std::to_string(base_id_) + "\" length=\"" + centimetres(std::abs(off)) +
                    "\" angle=\"" + number_text(degrees < 0 ? degrees + 360 : degrees) +
                    "\" typeLine=\"none\" lineColor=\"black\" mx=\"0.1\" my=\"0.1\"/>\n";
    return id;
  }

  int cubic(int a, int first, int second, int b) {
    const int id = ++last_id_;
    calculation_ += "   <spline id=\"" + std::to_string(id) + "\" type=\"cubicBezier\" point1=\"" +
                    std::to_string(a) + "\" point2=\"" + std::to_string(first) + "\" point3=\"" +
                    std::to_string(second) + "\" point4=\"" + std::to_string(b) +
                    "\" color=\"black\"/>\n";
    return id;
  }

  /// What a detail is made of: another object that stands for one of the calculation.
  int node(int object, const char* element, const char* type) {
    const int id = ++last_id_;
    modeling_ += "   <" + std::string(element) + " id=\"" + std::to_string(id) + "\" idObject=\"" +
                 std::to_string(object) + "\" type=\"" + type + "\" inUse=\"true\"" +
                 (std::string(element) == "point" ? " mx=\"0.1\" my=\"0.1\"" : "") + "/>\n";
    return id;
  }

  std::string text(const std::string& name, const std::string& detail) const {
    return " <draw name=\"" + name + "\">\n  <calculation>\n" + calculation_ +
           "  </calculation>\n  <modeling>\n" + modeling_ + "  </modeling>\n  <details>\n" +
           detail + "  </details>\n  <groups/>\n </draw>\n";
  }

 private:
  std::string letters_;
  Place base_;
  int& last_id_;
  int base_id_ = 0;
  int points_ = 0;
  std::string calculation_, modeling_;
};

/// The nodes of a detail, clockwise, as Valentina's allowances want them.
std::string nodes_text(const std::vector<OutlinePart>& parts, const LaidOut& lay,
                       const PatternPieceOptions& options, ValentinaBlock& block) {
  const std::size_t count = parts.size();
  std::vector<int> corners;
  for (const OutlinePart& part : parts) {
    corners.push_back(block.point(lay(part.start)));
  }
  std::vector<std::string> nodes;
  for (std::size_t i = 0; i < count; ++i) {
    const OutlinePart& part = parts[i];
    // Against the outline's direction a part comes before its own start.
    std::string widths;
    if (part.hem) {
      widths += " before=\"" + centimetres(options.hem_allowance) + "\"";
    }
    if (parts[(i + count - 1) % count].hem) {
      widths += " after=\"" + centimetres(options.hem_allowance) + "\"";
    }
    nodes.push_back("     <node idObject=\"" +
                    std::to_string(block.node(corners[i], "point", "modeling")) +
                    "\" type=\"NodePoint\"" + widths + "/>\n");
    if (part.curved) {
      const int first = block.point(lay(part.first));
      const int second = block.point(lay(part.second));
      const int curve = block.cubic(corners[i], first, second, corners[(i + 1) % count]);
      nodes.push_back("     <node idObject=\"" +
                      std::to_string(block.node(curve, "spline", "modelingSpline")) +
                      "\" type=\"NodeSpline\" reverse=\"1\"/>\n");
    }
  }
  std::string text;
  for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) {
    text += *node;
  }
  return text;
}

std::string block_text(const Panel& panel, const PatternPiece& piece, const std::string& letters,
                       const PatternPieceOptions& options, int& last_id) {
  constexpr double kOutside = 0.01;  // m: no point lies on the base, in no direction from there
  const Eigen::Vector2d low = piece.sew_line.colwise().minCoeff();
  ValentinaBlock block(letters, place_of(low) - Place(kOutside, kOutside), last_id);
  const std::string nodes =
      nodes_text(outline_parts(panel), laid_out(panel, piece), options, block);
  const std::string top =
      std::to_string(block.node(block.point(place_of(piece.grain_to)), "point", "pin"));
  const std::string bottom =
      std::to_string(block.node(block.point(place_of(piece.grain_from)), "point", "pin"));
  const Place middle = place_of((piece.grain_from + piece.grain_to) / 2);
  const std::string label = std::to_string(block.node(block.point(middle), "point", "pin"));
  const std::string name = xml_text(piece.name);
  std::string pins;
  for (const std::string& pin : {top, bottom, label}) {
    pins += "     <record>" + pin + "</record>\n";
  }
  const std::string detail =
      "   <detail id=\"" + std::to_string(++last_id) + "\" name=\"" + name +
      "\" version=\"2\" width=\"" + centimetres(options.seam_allowance) +
      "\" seamAllowance=\"true\" mx=\"0\" my=\"0\" inLayout=\"true\" "
      "forbidFlipping=\"false\" united=\"false\">\n"
      "    <data letter=\"\" visible=\"true\" fontSize=\"0\" width=\"8\" height=\"3\" "
      "rotation=\"0\" mx=\"0\" my=\"0\" centerPin=\"" +
      label + "\"/>\n    <grainline visible=\"true\" arrows=\"0\" topPin=\"" + top +
      "\" bottomPin=\"" + bottom +
      "\" mx=\"0\" my=\"0\" length=\"10\" rotation=\"90\"/>\n    <nodes>\n" + nodes +
      "    </nodes>\n    <pins>\n" + pins + "    </pins>\n   </detail>\n";
  return block.text(name, detail);
}

}  // namespace

std::string valentina_text(const SewingPattern& pattern, const PatternLayout& layout,
                           const PatternPieceOptions& options, const std::string& title) {
  ATELIER_CHECK(pattern.panels.size() == layout.pieces.size(), "the layout of this pattern");
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<pattern>\n <version>0.5.1</version>\n"
      " <unit>cm</unit>\n <description>" +
      xml_text(title) + "</description>\n <notes/>\n <measurements/>\n <increments/>\n";
  int last_id = 0;
  for (std::size_t i = 0; i < pattern.panels.size(); ++i) {
    text += block_text(pattern.panels[i], layout.pieces[i], letters_of(i), options, last_id);
  }
  return text + "</pattern>\n";
}

}  // namespace atelier
