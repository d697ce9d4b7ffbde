#include "registration/flattening/pattern_pieces.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/cross.h"
#include "core/error.h"
#include "core/saturating_cast.h"
#include "registration/flattening/offset_outline.h"
#include "registration/outlines/outline_measures.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;

/// Every point of a piece, and every direction.
template <typename Point, typename Direction>
void change_piece(PatternPiece& piece, const Point& point, const Direction& direction) {
  for (Points2* line : {&piece.sew_line, &piece.cut_line}) {
    for (Index i = 0; i < line->rows(); ++i) {
      line->row(i) = point(Vector2(line->row(i))).transpose();
    }
  }
  for (Notch& notch : piece.notches) {
    notch.position = point(notch.position);
    notch.outwards = direction(notch.outwards);
  }
  for (EdgeLabel& label : piece.labels) {
    label.position = point(label.position);
    label.along = direction(label.along);
  }
  for (Vector2* end : {&piece.grain_from, &piece.grain_to}) {
    *end = point(*end);
  }
  if (piece.fold) {
    piece.fold = {point(piece.fold->first), point(piece.fold->second)};
  }
}

void turn_half(PatternPiece& piece) {
  const auto turned = [](const Vector2& at) -> Vector2 { return -at; };
  change_piece(piece, turned, turned);
}

void move_piece(PatternPiece& piece, const Vector2& by) {
  change_piece(
      piece, [&](const Vector2& at) -> Vector2 { return at + by; },
      [](const Vector2& direction) { return direction; });
}

/// Of the skyline, m. Wide fabric, as of a mesh in another unit, has no more columns than 10 m.
double column_of(double fabric_width) {
  return std::max(0.005, fabric_width / 2000);
}

/// Lowest and highest of a piece's cut line over columns of the fabric.
struct Profile {
  std::vector<double> low, high;
};

Profile profile_of(const PatternPiece& piece, double gap, double column) {
  const double left = piece.cut_line.col(0).minCoeff();
  const double right = piece.cut_line.col(0).maxCoeff();
  const auto columns = saturating_cast<std::size_t>((right - left + gap) / column + 2);
  Profile profile{std::vector<double>(columns, 1e9), std::vector<double>(columns, -1e9)};
  for (Index i = 0; i < piece.cut_line.rows(); ++i) {
    const Vector2 a = piece.cut_line.row(i);
    const Vector2 b = piece.cut_line.row((i + 1) % piece.cut_line.rows());
    const double from = (std::min(a.x(), b.x()) - left) / column;
    const double to = (std::max(a.x(), b.x()) - left + gap) / column;
    for (auto c = saturating_cast<std::size_t>(std::max(0.0, from));
         c < columns && static_cast<double>(c) <= to + 1; ++c) {
      profile.low[c] = std::min({profile.low[c], a.y(), b.y()});
      profile.high[c] = std::max({profile.high[c], a.y(), b.y()});
    }
  }
  return profile;
}

void pack(PatternLayout& layout, double gap) {
  std::vector<std::size_t> order(layout.pieces.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto height = [&](std::size_t i) {
    return layout.pieces[i].cut_line.col(1).maxCoeff() -
           layout.pieces[i].cut_line.col(1).minCoeff();
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return height(a) > height(b); });
  for (const PatternPiece& piece : layout.pieces) {
    const double wide = piece.cut_line.col(0).maxCoeff() - piece.cut_line.col(0).minCoeff();
    layout.width = std::max(layout.width, wide + gap + 3 * column_of(wide));
  }
  const double column = column_of(layout.width);
  const auto columns = saturating_cast<std::size_t>(layout.width / column);
  std::vector<double> skyline(columns, 0);
  for (const std::size_t i : order) {
    PatternPiece& piece = layout.pieces[i];
    struct Place {
      double top = 1e18, base = 0;
      std::size_t column = 0;
      bool turned = false;
    } best;
    for (const bool turned : {false, true}) {
      PatternPiece tried = piece;
      if (turned) {
        turn_half(tried);
      }
      const Profile profile = profile_of(tried, gap, column);
      const std::size_t across = std::min(profile.low.size(), columns);
      for (std::size_t c = 0; c + across <= columns; ++c) {
        double base = -1e18;
        for (std::size_t k = 0; k < across; ++k) {
          base = std::max(base, skyline[c + k] - profile.low[k]);
        }
        const double top = base + tried.cut_line.col(1).maxCoeff();
        if (top < best.top - 1e-9) {
          best = {top, base, c, turned};
        }
      }
    }
    if (best.turned) {
      turn_half(piece);
    }
    const Profile profile = profile_of(piece, gap, column);
    move_piece(piece, {static_cast<double>(best.column) * column - piece.cut_line.col(0).minCoeff(),
                       best.base});
    for (std::size_t k = 0; k < profile.high.size() && best.column + k < columns; ++k) {
      double& line = skyline[best.column + k];
      line = std::max(line, best.base + profile.high[k] + gap);
    }
    layout.length = std::max(layout.length, piece.cut_line.col(1).maxCoeff());
  }
}

/// The longest line along the grain that fits into the piece's middle half.
void place_grain(PatternPiece& piece) {
  const double left = piece.sew_line.col(0).minCoeff();
  const double right = piece.sew_line.col(0).maxCoeff();
  double best = -1;
  for (int step = -5; step <= 5; ++step) {
    const double x = (left + right) / 2 + 0.05 * step * (right - left);
    std::vector<double> ys;
    for (Index i = 0; i < piece.sew_line.rows(); ++i) {
      const Vector2 a = piece.sew_line.row(i);
      const Vector2 b = piece.sew_line.row((i + 1) % piece.sew_line.rows());
      if ((a.x() <= x) != (b.x() <= x)) {
        ys.push_back(a.y() + (x - a.x()) / (b.x() - a.x()) * (b.y() - a.y()));
      }
    }
    std::sort(ys.begin(), ys.end());
    for (std::size_t i = 0; i + 1 < ys.size(); i += 2) {
      if (ys[i + 1] - ys[i] > best + 1e-6) {
        best = ys[i + 1] - ys[i];
        piece.grain_from = {x, ys[i] + 0.2 * best};
        piece.grain_to = {x, ys[i] + 0.8 * best};
      }
    }
  }
}

/// A side of a seam in the direction in which both sides run, along edges of one panel after
/// another.
struct SeamSide {
  std::vector<std::pair<int, int>> edges;  ///< panel, edge
  bool against = false;                    ///< the panel's own direction
};

/// A seam, which may be several pairs of edges.
struct WholeSeam {
  std::string name;
  SeamSide a, b;
};

std::vector<WholeSeam> whole_seams(const SewingPattern& pattern) {
  std::vector<WholeSeam> seams;
  for (const SewnEdges& pair : pattern.seams) {
    if (seams.empty() || seams.back().name != pair.name ||
        seams.back().b.against != pair.reversed) {
      seams.push_back({pair.name, {{}, false}, {{}, pair.reversed}});
    }
    seams.back().a.edges.emplace_back(pair.panel_a, pair.edge_a);
    seams.back().b.edges.emplace_back(pair.panel_b, pair.edge_b);
  }
  return seams;
}

/// A place on a side of a seam.
struct SeamPlace {
  int panel = 0;
  Vector2 position, along;
};

SeamPlace place_at(const SewingPattern& pattern, const SeamSide& side, double at) {
  SeamPlace place;
  for (const auto& [panel_idx, edge] : side.edges) {
    const Panel& panel = pattern.panels[static_cast<std::size_t>(panel_idx)];
    const double length = edge_length(panel, edge);
    const bool last = &side.edges.back().second == &edge;
    if (at > length && !last) {
      at -= length;
      continue;
    }
    constexpr int kSteps = 200;
    const Points2 points = sample_edge(panel, edge, kSteps);
    const double share = std::clamp(at / length, 0.0, 1.0);
    const double step = (side.against ? 1 - share : share) * kSteps;
    const Index before = std::min<Index>(saturating_cast<Index>(step), kSteps - 1);
    const Vector2 from = points.row(before);
    const Vector2 to = points.row(before + 1);
    place.panel = panel_idx;
    place.position = from + (step - static_cast<double>(before)) * (to - from);
    place.along = (to - from).normalized();
    break;
  }
  return place;
}

double side_length(const SewingPattern& pattern, const SeamSide& side) {
  double length = 0;
  for (const auto& [panel, edge] : side.edges) {
    length += edge_length(pattern.panels[static_cast<std::size_t>(panel)], edge);
  }
  return length;
}

void add_notches(const SewingPattern& pattern, double spacing, std::vector<PatternPiece>& pieces) {
  for (const WholeSeam& seam : whole_seams(pattern)) {
    const double length = side_length(pattern, seam.a);
    const int count = saturating_cast<int>(length / spacing);
    for (int i = 1; i <= count; ++i) {
      for (const SeamSide* side : {&seam.a, &seam.b}) {
        const SeamPlace place =
            place_at(pattern, *side, side_length(pattern, *side) * i / (count + 1));
        pieces[static_cast<std::size_t>(place.panel)].notches.push_back(
            {place.position, {place.along.y(), -place.along.x()}, seam.name});
      }
    }
  }
}

/// Names of seams and openings at the middle of their sides, a little inside of them.
void add_labels(const SewingPattern& pattern, std::vector<PatternPiece>& pieces) {
  constexpr double kInside = 0.007;  // m
  constexpr double kLeast = 0.05;    // m of an edge with a name
  const auto add = [&](const SeamPlace& place, const std::string& name) {
    const Vector2 inwards(-place.along.y(), place.along.x());
    pieces[static_cast<std::size_t>(place.panel)].labels.push_back(
        {name, place.position + kInside * inwards, place.along});
  };
  for (const WholeSeam& seam : whole_seams(pattern)) {
    for (const SeamSide* side : {&seam.a, &seam.b}) {
      if (const double length = side_length(pattern, *side); length > kLeast) {
        add(place_at(pattern, *side, length / 2), seam.name);
      }
    }
  }
  for (std::size_t p = 0; p < pattern.panels.size(); ++p) {
    const Panel& panel = pattern.panels[p];
    for (std::size_t e = 0; e < panel.edges.size(); ++e) {
      // Of an opening's edges in a row the first one.
      const std::string& before =
          panel.edges[(e + panel.edges.size() - 1) % panel.edges.size()].name;
      const int edge = static_cast<int>(e);
      const double length = edge_length(panel, edge);
      if (!panel.edges[e].name.empty() && (e == 0 || panel.edges[e].name != before) &&
          length > kLeast) {
        add(place_at(pattern, {{{static_cast<int>(p), edge}}, false}, length / 2),
            panel.edges[e].name);
      }
    }
  }
}

/// Allowance of each segment of a panel's outline, as panel_outline has them.
std::vector<double> allowances_of(const Panel& panel, const PatternPieceOptions& options) {
  std::vector<double> allowances;
  for (const PanelEdge& edge : panel.edges) {
    Panel alone = panel;
    alone.edges = {edge};
    allowances.insert(allowances.end(), static_cast<std::size_t>(panel_outline(alone).rows()),
                      is_hem(edge) ? options.hem_allowance : options.seam_allowance);
  }
  return allowances;
}

/// Where the piece is its own mirror image about a line along the grain.
void place_fold(PatternPiece& piece) {
  constexpr double kAlike = 0.003;    // m
  constexpr double kUpright = 0.999;  // cosine of 2.5 degrees
  const MirrorLine line = mirror_line(piece.sew_line);
  if (line.off > kAlike || line.along.y() < kUpright) {
    return;
  }
  double low = 0;
  double high = 0;
  for (Index i = 0; i < piece.sew_line.rows(); ++i) {
    const Vector2 a = Vector2(piece.sew_line.row(i)) - line.point;
    const Vector2 b = Vector2(piece.sew_line.row((i + 1) % piece.sew_line.rows())) - line.point;
    const double from = cross(line.along, a);
    const double to = cross(line.along, b);
    if ((from <= 0) != (to <= 0)) {
      const double along = line.along.dot(a + from / (from - to) * (b - a));
      low = std::min(low, along);
      high = std::max(high, along);
    }
  }
  piece.fold = {line.point + low * line.along, line.point + high * line.along};
}

}  // namespace

OptionTable describe(PatternPieceOptions& options) {
  OptionTable table;
  table.add("seam_allowance", options.seam_allowance, 0, 0.1, "m", "Width of the seam allowance");
  table.add("hem_allowance", options.hem_allowance, 0, 0.2, "m",
            "Width of the allowance at hems and cuffs");
  table.add("notch_spacing", options.notch_spacing, 0, 10, "m",
            "Minimum distance between the notches of a seam; 0: no notches");
  table.add("smoothing", options.smoothing, 0, 0.2, "m",
            "Length along outlines over which they are smoothed; 0: no smoothing");
  table.add("curve_tolerance", options.curve_tolerance, 0, 0.05, "m",
            "Maximum distance from the smoothed outline of the lines, arcs and cubics that are "
            "drawn; smaller for more detail; 0: a line for each segment");
  table.add("symmetry", options.symmetry, 0, 0.1, "m",
            "Rms distance of a panel from its own mirror image, or from another's, below which it "
            "is drawn as that; 0: panels are drawn as they lie");
  table.add("fabric_width", options.fabric_width, 0.1, 10, "m",
            "Width of the fabric on which pieces are packed");
  table.add("gap", options.gap, 0, 0.5, "m", "Gap between packed pieces");
  return table;
}

bool is_hem(const PanelEdge& edge) {
  return edge.name.starts_with("hem") || edge.name.starts_with("cuff");
}

PatternLayout lay_out_pieces(const SewingPattern& pattern, const PatternPieceOptions& options) {
  PatternLayout layout;
  layout.width = options.fabric_width;
  layout.seam_mismatch = seam_mismatch(pattern);
  for (const Panel& panel : pattern.panels) {
    PatternPiece piece;
    piece.name = panel.name;
    piece.sew_line = panel_outline(panel);
    piece.cut_line = offset_outline(piece.sew_line, allowances_of(panel, options));
    place_grain(piece);
    place_fold(piece);
    layout.pieces.push_back(std::move(piece));
  }
  if (options.notch_spacing > 0) {
    add_notches(pattern, options.notch_spacing, layout.pieces);
  }
  add_labels(pattern, layout.pieces);
  pack(layout, options.gap);
  return layout;
}

}  // namespace atelier
