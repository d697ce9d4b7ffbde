#include "registration/flattening/pattern_pieces.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/cross.h"
#include "core/error.h"
#include "core/saturating_cast.h"
#include "core/topology.h"
#include "registration/flattening/flat_overlaps.h"
#include "registration/flattening/offset_outline.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;
using Run = std::vector<Vector2>;

double length_of(const Run& run) {
  double length = 0;
  for (std::size_t i = 1; i < run.size(); ++i) {
    length += (run[i] - run[i - 1]).norm();
  }
  return length;
}

Run points_of(const Points2& flat, const std::vector<int>& vertices) {
  Run run;
  for (const int v : vertices) {
    run.emplace_back(flat.row(v).transpose());
  }
  return run;
}

/// Points that stay: ends, and where the run turns by more than 0.6 rad within the smoothing.
std::vector<std::size_t> corners_of(const Run& run, double reach) {
  std::vector<std::size_t> corners{0};
  std::vector<double> at(run.size(), 0);
  for (std::size_t i = 1; i < run.size(); ++i) {
    at[i] = at[i - 1] + (run[i] - run[i - 1]).norm();
  }
  constexpr double kCorner = 0.7;  // rad
  constexpr double kEdges = 3;     // a zigzag of single edges is no corner
  reach = std::max(reach, kEdges * at.back() / static_cast<double>(run.size() - 1));
  std::vector<double> turning(run.size(), 0);
  for (std::size_t i = 1; i + 1 < run.size(); ++i) {
    std::size_t before = i - 1;
    std::size_t after = i + 1;
    while (before > 0 && at[i] - at[before] < reach) {
      --before;
    }
    while (after + 1 < run.size() && at[after] - at[i] < reach) {
      ++after;
    }
    const Vector2 in = run[i] - run[before];
    const Vector2 out = run[after] - run[i];
    turning[i] = std::abs(std::atan2(cross(in, out), in.dot(out)));
  }
  for (std::size_t i = 1; i + 1 < run.size(); ++i) {
    if (turning[i] > kCorner && turning[i] >= turning[i - 1] && turning[i] > turning[i + 1] &&
        at[i] - at[corners.back()] > reach / 2) {
      corners.push_back(i);
    }
  }
  corners.push_back(run.size() - 1);
  return corners;
}

/// Least squares with a penalty on second differences (Whittaker 1923; Eilers 2003): a low-pass of
/// the given reach; `held` points stay. Rows of the pentadiagonal system by Gauss-Seidel would be
/// slow: it is solved part by part, densely banded.
Run smoothed(const Run& run, const std::vector<std::size_t>& held, double reach) {
  Run result = run;
  for (std::size_t part = 0; part + 1 < held.size(); ++part) {
    const std::size_t from = held[part];
    const auto inner = static_cast<Index>(held[part + 1] - from) - 1;
    if (inner < 1) {
      continue;
    }
    const Run piece(run.begin() + static_cast<std::ptrdiff_t>(from),
                    run.begin() + static_cast<std::ptrdiff_t>(from) + inner + 2);
    const double spacing = length_of(piece) / static_cast<double>(inner + 1);
    const double stiffness = std::pow(reach / std::max(spacing, 1e-9), 4);
    // (I + stiffness D'D) q = p, with the ends known.
    Eigen::MatrixXd system = Eigen::MatrixXd::Identity(inner, inner);
    Points2 right(inner, 2);
    for (Index i = 0; i < inner; ++i) {
      right.row(i) = piece[static_cast<std::size_t>(i) + 1].transpose();
    }
    for (Index i = 0; i < inner; ++i) {
      const double weights[3] = {1, -2, 1};
      for (int p = 0; p < 3; ++p) {
        const Index row = i + p - 1;
        if (row < 0 || row >= inner) {
          continue;
        }
        for (int q = 0; q < 3; ++q) {
          const Index column = i + q - 1;
          const double entry = stiffness * weights[p] * weights[q];
          if (column < 0 || column >= inner) {
            right.row(row) -= entry * piece[static_cast<std::size_t>(column + 1)].transpose();
          } else {
            system(row, column) += entry;
          }
        }
      }
    }
    const Points2 solved = system.llt().solve(right);
    for (Index i = 0; i < inner; ++i) {
      result[from + 1 + static_cast<std::size_t>(i)] = solved.row(i).transpose();
    }
  }
  return result;
}

Run blended(const Run& a, const Run& b, double share) {
  Run result = a;
  for (std::size_t i = 0; i < a.size(); ++i) {
    result[i] += share * (b[i] - a[i]);
  }
  return result;
}

double mismatch_of(const Run& a, const Run& b) {
  return 2 * std::abs(length_of(a) - length_of(b)) / std::max(length_of(a) + length_of(b), 1e-12);
}

/// Smoothed positions of the outline's vertices, and the largest mismatch of seams. What is sewn or
/// open at a panel with `as_is` stays.
std::pair<Points2, double> smooth_outlines(const FlatPattern& pattern,
                                           const std::vector<std::vector<int>>& loops, double reach,
                                           const std::vector<char>& as_is,
                                           const std::vector<int>& panel_of) {
  constexpr double kMismatch = 0.002;
  Points2 flat = pattern.vertices;
  std::vector<char> sewn(static_cast<std::size_t>(flat.rows()), 0);
  std::vector<char> seam_end(sewn.size(), 0);
  double worst = 0;
  for (const FlatSeam& seam : pattern.seams) {
    Run a = points_of(pattern.vertices, seam.a);
    Run b = points_of(pattern.vertices, seam.b);
    if (reach > 0 && a.size() > 2 && as_is[static_cast<std::size_t>(seam.panel_a)] == 0 &&
        as_is[static_cast<std::size_t>(seam.panel_b)] == 0) {
      // Corners of either side are kept on both.
      std::vector<std::size_t> held = corners_of(a, reach);
      for (const std::size_t corner : corners_of(b, reach)) {
        held.push_back(corner);
      }
      std::sort(held.begin(), held.end());
      held.erase(std::unique(held.begin(), held.end()), held.end());
      const Run smooth_a = smoothed(a, held, reach);
      const Run smooth_b = smoothed(b, held, reach);
      for (const double share : {1.0, 0.75, 0.5, 0.25}) {
        const Run some_a = blended(a, smooth_a, share);
        const Run some_b = blended(b, smooth_b, share);
        if (mismatch_of(some_a, some_b) <= std::max(kMismatch, mismatch_of(a, b))) {
          a = some_a;
          b = some_b;
          break;
        }
      }
    }
    worst = std::max(worst, mismatch_of(a, b));
    for (std::size_t i = 0; i < a.size(); ++i) {
      flat.row(seam.a[i]) = a[i].transpose();
      flat.row(seam.b[i]) = b[i].transpose();
      sewn[static_cast<std::size_t>(seam.a[i])] = sewn[static_cast<std::size_t>(seam.b[i])] = 1;
    }
    for (const int v : {seam.a.front(), seam.a.back(), seam.b.front(), seam.b.back()}) {
      seam_end[static_cast<std::size_t>(v)] = 1;
    }
  }
  if (!(reach > 0)) {
    return {flat, worst};
  }
  // Edges that are not sewn: runs from seam end to seam end, or whole loops.
  for (const std::vector<int>& loop : loops) {
    if (as_is[static_cast<std::size_t>(panel_of[static_cast<std::size_t>(loop.front())])] != 0) {
      continue;
    }
    const std::size_t count = loop.size();
    const auto first = std::find_if(loop.begin(), loop.end(), [&](int v) {
      return seam_end[static_cast<std::size_t>(v)] != 0;
    });
    const auto start = static_cast<std::size_t>(first == loop.end() ? 0 : first - loop.begin());
    std::vector<int> run{loop[start]};
    for (std::size_t i = 1; i <= count; ++i) {
      const int v = loop[(start + i) % count];
      run.push_back(v);
      if (seam_end[static_cast<std::size_t>(v)] == 0 && i < count) {
        continue;
      }
      const bool is_open =
          run.size() > 2 && std::none_of(run.begin() + 1, run.end() - 1, [&](int inner) {
            return sewn[static_cast<std::size_t>(inner)] != 0;
          });
      if (is_open) {
        const Run points = points_of(pattern.vertices, run);
        const Run smooth = smoothed(points, corners_of(points, reach), reach);
        for (std::size_t k = 1; k + 1 < run.size(); ++k) {
          flat.row(run[k]) = smooth[k].transpose();
        }
      }
      run = {v};
    }
  }
  return {flat, worst};
}

/// The same, but panels whose smoothed outline would cross itself stay as they are.
std::pair<Points2, double> smooth_apart(const FlatPattern& pattern,
                                        const std::vector<std::vector<int>>& loops, double reach,
                                        const std::vector<int>& panel_of) {
  std::vector<char> as_is(static_cast<std::size_t>(pattern.cut.panel_count), 0);
  for (;;) {
    std::pair<Points2, double> smooth = smooth_outlines(pattern, loops, reach, as_is, panel_of);
    bool more = false;
    for (const std::vector<int>& loop : loops) {
      char& stays =
          as_is[static_cast<std::size_t>(panel_of[static_cast<std::size_t>(loop.front())])];
      if (stays == 0 && crosses_itself(smooth.first(loop, Eigen::all))) {
        stays = 1;
        more = true;
      }
    }
    if (!more) {
      return smooth;
    }
  }
}

void turn_half(PatternPiece& piece) {
  const auto turn = [](Points2& points) { points = -points; };
  turn(piece.sew_line);
  turn(piece.cut_line);
  for (Notch& notch : piece.notches) {
    notch.position = -notch.position;
    notch.outwards = -notch.outwards;
  }
  piece.grain_from = -piece.grain_from;
  piece.grain_to = -piece.grain_to;
}

void move_piece(PatternPiece& piece, const Vector2& by) {
  piece.sew_line.rowwise() += by.transpose();
  piece.cut_line.rowwise() += by.transpose();
  for (Notch& notch : piece.notches) {
    notch.position += by;
  }
  piece.grain_from += by;
  piece.grain_to += by;
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

void add_notches(const FlatPattern& pattern, const Points2& flat, double spacing,
                 std::vector<PatternPiece>& pieces) {
  for (const FlatSeam& seam : pattern.seams) {
    const Run a = points_of(flat, seam.a);
    const Run b = points_of(flat, seam.b);
    const int count = saturating_cast<int>(length_of(a) / spacing);
    double passed = 0;
    int next = 1;
    for (std::size_t i = 1; i + 1 < a.size() && next <= count; ++i) {
      passed += (a[i] - a[i - 1]).norm();
      if (passed < length_of(a) * next / (count + 1)) {
        continue;
      }
      ++next;
      const auto add = [&](int panel, const Run& run, double side) {
        const Vector2 along = (run[i + 1] - run[i - 1]).normalized();
        pieces[static_cast<std::size_t>(panel)].notches.push_back(
            {run[i], side * Vector2(along.y(), -along.x()), seam.name});
      };
      add(seam.panel_a, a, 1);
      add(seam.panel_b, b, -1);
    }
  }
}

}  // namespace

OptionTable describe(PatternPieceOptions& options) {
  OptionTable table;
  table.add("seam_allowance", options.seam_allowance, 0, 0.1, "m",
            "Width of the seam allowance around every piece");
  table.add("notch_spacing", options.notch_spacing, 0, 10, "m",
            "Minimum distance between the notches of a seam; 0: no notches");
  table.add("smoothing", options.smoothing, 0, 0.2, "m",
            "Length along outlines over which they are smoothed; 0: no smoothing");
  table.add("fabric_width", options.fabric_width, 0.1, 10, "m",
            "Width of the fabric on which pieces are packed");
  table.add("gap", options.gap, 0, 0.5, "m", "Gap between packed pieces");
  return table;
}

PatternLayout lay_out_pattern(const FlatPattern& pattern, const PatternPieceOptions& options) {
  const Topology topology =
      topology_of(pattern.cut.faces, static_cast<Index>(pattern.cut.source.size()));
  const std::vector<std::vector<int>> loops = boundary_loops(topology);
  std::vector<int> panel_of(pattern.cut.source.size(), 0);
  for (Index f = 0; f < pattern.cut.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      panel_of[static_cast<std::size_t>(pattern.cut.faces(f, k))] =
          pattern.cut.panels[static_cast<std::size_t>(f)];
    }
  }
  PatternLayout layout;
  layout.width = options.fabric_width;
  const auto [flat, mismatch] = smooth_apart(pattern, loops, options.smoothing, panel_of);
  layout.seam_mismatch = mismatch;
  layout.pieces.resize(static_cast<std::size_t>(pattern.cut.panel_count));
  for (const std::vector<int>& loop : loops) {
    const auto p = static_cast<std::size_t>(panel_of[static_cast<std::size_t>(loop.front())]);
    PatternPiece& piece = layout.pieces[p];
    piece.name = pattern.panel_names[p];
    piece.sew_line.resize(static_cast<Index>(loop.size()), 2);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      piece.sew_line.row(static_cast<Index>(i)) = flat.row(loop[i]);
    }
    piece.cut_line = offset_outline(piece.sew_line, options.seam_allowance);
    place_grain(piece);
  }
  if (options.notch_spacing > 0) {
    add_notches(pattern, flat, options.notch_spacing, layout.pieces);
  }
  pack(layout, options.gap);
  return layout;
}

}  // namespace atelier
