#include "registration/drafting/draft_pattern.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/error.h"
#include "core/topology.h"
#include "registration/flattening/flat_overlaps.h"
#include "registration/outlines/outline_measures.h"
#include "registration/outlines/symmetric_outlines.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;

constexpr double kEased = 0.02;  // share by which sides differ that are not meant to be equal
constexpr int kAsItIs = 2;       // the last of the ways in which a panel is drawn

std::vector<int> panel_of_vertices(const FlatPattern& pattern) {
  std::vector<int> panel_of(pattern.cut.source.size(), -1);
  for (Index f = 0; f < pattern.cut.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      panel_of[static_cast<std::size_t>(pattern.cut.faces(f, k))] =
          pattern.cut.panels[static_cast<std::size_t>(f)];
    }
  }
  return panel_of;
}

Points2 points_of_run(const FlatPattern& pattern, const std::vector<int>& run) {
  Points2 points(static_cast<Index>(run.size()), 2);
  for (std::size_t i = 0; i < run.size(); ++i) {
    points.row(static_cast<Index>(i)) = pattern.vertices.row(run[i]);
  }
  return points;
}

/// How closely panels are drawn whose outline crosses itself else.
FitRunsOptions closeness(const FitRunsOptions& options, int way) {
  const double share = way == 0 ? 1 : way == 1 ? 0.25 : 0;
  return {share * options.reach, share * options.tolerance};
}

/// An edge of a panel before its corners have numbers.
struct DraftEdge {
  int to = 0;  ///< flat vertex; it is found by the one from which it starts
  Vector2 start = Vector2::Zero();
  PanelEdge shape;
  int seam = -1, piece = -1;  ///< -1: open
  bool is_b = false;
};
using DraftEdges = std::map<int, DraftEdge>;

PanelEdge against(PanelEdge edge) {
  std::reverse(edge.controls.begin(), edge.controls.end());
  edge.bulge = -edge.bulge;
  return edge;
}

void add_seam(DraftEdges& edges, const FlatPattern& pattern, int index,
              const FitRunsOptions& options) {
  const FlatSeam& seam = pattern.seams[static_cast<std::size_t>(index)];
  const FittedRuns fitted =
      fit_runs({points_of_run(pattern, seam.a), points_of_run(pattern, seam.b)}, options);
  for (std::size_t i = 0; i + 1 < fitted.joints.size(); ++i) {
    const auto row = static_cast<Index>(i);
    const int piece = static_cast<int>(i);
    const std::size_t from = fitted.joints[i];
    const std::size_t to = fitted.joints[i + 1];
    edges[seam.a[from]] = {seam.a[to], fitted.corners[0].row(row), fitted.edges[0][i], index, piece,
                           false};
    edges[seam.b[to]] = {
        seam.b[from], fitted.corners[1].row(row + 1), against(fitted.edges[1][i]), index, piece,
        true};
  }
}

void add_open_run(DraftEdges& edges, const FlatPattern& pattern, const PatternNames& names,
                  const std::vector<int>& run, const FitRunsOptions& options) {
  const FittedRuns fitted = fit_runs({points_of_run(pattern, run)}, options);
  for (std::size_t i = 0; i + 1 < fitted.joints.size(); ++i) {
    const auto row = static_cast<Index>(i);
    DraftEdge edge{run[fitted.joints[i + 1]], fitted.corners[0].row(row), fitted.edges[0][i]};
    if (!names.opening_at.empty()) {
      const int opening = names.opening_at[static_cast<std::size_t>(run[fitted.joints[i]])];
      edge.shape.name = opening >= 0 ? names.openings[static_cast<std::size_t>(opening)] : "";
    }
    edges[run[fitted.joints[i]]] = std::move(edge);
  }
}

/// Begins a loop that no seam parts at its sharpest turn.
std::vector<int> from_sharpest(const FlatPattern& pattern, std::vector<int> loop) {
  const std::size_t count = loop.size();
  const std::size_t reach = std::max<std::size_t>(1, count / 40);
  double sharpest = -1;
  std::size_t first = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = [&](std::size_t k) { return pattern.vertices.row(loop[k % count]); };
    const Vector2 in = at(i) - at(i + count - reach);
    const Vector2 out = at(i + reach) - at(i);
    const double turn = 1 - in.normalized().dot(out.normalized());
    if (turn > sharpest + 1e-9) {
      sharpest = turn;
      first = i;
    }
  }
  std::rotate(loop.begin(), loop.begin() + static_cast<std::ptrdiff_t>(first), loop.end());
  return loop;
}

/// Runs of a panel's outline that no seam covers.
void add_open_runs(DraftEdges& edges, const FlatPattern& pattern, const PatternNames& names,
                   std::vector<int> loop, const FitRunsOptions& options) {
  const auto starts_seam = [&](int v) { return edges.count(v) != 0 && edges.at(v).seam >= 0; };
  std::vector<char> inside(static_cast<std::size_t>(pattern.vertices.rows()), 0);
  for (const FlatSeam& seam : pattern.seams) {
    for (const std::vector<int>* side : {&seam.a, &seam.b}) {
      for (std::size_t i = 1; i + 1 < side->size(); ++i) {
        inside[static_cast<std::size_t>((*side)[i])] = 1;
      }
    }
  }
  const auto first = std::find_if(loop.begin(), loop.end(), starts_seam);
  if (first == loop.end()) {
    loop = from_sharpest(pattern, std::move(loop));
  } else {
    std::rotate(loop.begin(), first, loop.end());
  }
  loop.push_back(loop.front());
  std::vector<int> run;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const int v = loop[i];
    if (!run.empty()) {
      run.push_back(v);
      if (starts_seam(v) || i + 1 == loop.size()) {
        add_open_run(edges, pattern, names, run, options);
        run.clear();
      }
    }
    if (run.empty() && !starts_seam(v) && inside[static_cast<std::size_t>(v)] == 0) {
      run.push_back(v);
    }
  }
}

/// Where the edges of the loops went.
struct EdgePlace {
  int panel = -1, edge = -1;
};
using SeamPlaces = std::map<std::pair<int, int>, std::array<EdgePlace, 2>>;  // seam, piece

Panel assembled(const DraftEdges& edges, const std::vector<int>& loop, int panel_idx,
                SeamPlaces& places) {
  Panel panel;
  const auto begin =
      std::find_if(loop.begin(), loop.end(), [&](int v) { return edges.count(v) != 0; });
  ATELIER_CHECK(begin != loop.end(), "an outline without edges");
  std::vector<Vector2> corners;
  for (int at = *begin; corners.empty() || at != *begin; at = edges.at(at).to) {
    const DraftEdge& drawn = edges.at(at);
    const int number = static_cast<int>(corners.size());
    PanelEdge edge = drawn.shape;
    edge.start = number;
    edge.end = number + 1;
    corners.push_back(drawn.start);
    if (drawn.seam >= 0) {
      places[{drawn.seam, drawn.piece}][drawn.is_b ? 1 : 0] = {panel_idx, number};
    }
    panel.edges.push_back(std::move(edge));
    ATELIER_CHECK(corners.size() <= loop.size(), "edges that do not close");
  }
  panel.edges.back().end = 0;
  panel.corners.resize(static_cast<Index>(corners.size()), 2);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    panel.corners.row(static_cast<Index>(i)) = corners[i].transpose();
  }
  return panel;
}

/// Moves a panel's corners; curves keep their shape between them.
void move_corners(Panel& panel, const Points2& corners) {
  for (PanelEdge& edge : panel.edges) {
    const Vector2 old_start = panel.corners.row(edge.start);
    const Vector2 old_chord = Vector2(panel.corners.row(edge.end)) - old_start;
    const Vector2 start = corners.row(edge.start);
    const Vector2 chord = Vector2(corners.row(edge.end)) - start;
    Eigen::Matrix2d turn;
    turn << old_chord.x(), old_chord.y(), -old_chord.y(), old_chord.x();
    const Vector2 ratio = turn * chord / old_chord.squaredNorm();  // chord / old_chord, complex
    Eigen::Matrix2d moved;
    moved << ratio.x(), -ratio.y(), ratio.y(), ratio.x();
    for (Vector2& control : edge.controls) {
      control = start + moved * (control - old_start);
    }
  }
  panel.corners = corners;
}

/// Edges whose lengths are to be the same in sum.
struct EqualEdges {
  std::vector<EdgePlace> a, b;
};

double length_at(const SewingPattern& pattern, const EdgePlace& place) {
  return edge_length(pattern.panels[static_cast<std::size_t>(place.panel)], place.edge);
}

double sum_of_lengths(const SewingPattern& pattern, const std::vector<EdgePlace>& edges) {
  double sum = 0;
  for (const EdgePlace& place : edges) {
    sum += length_at(pattern, place);
  }
  return sum;
}

/// Moves corners least so that the sums are equal: Gauss and Newton's method for constraints alone.
void equalize_lengths(SewingPattern& pattern, const std::vector<EqualEdges>& equal) {
  std::vector<Index> first{0};
  for (const Panel& panel : pattern.panels) {
    first.push_back(first.back() + 2 * panel.corners.rows());
  }
  const auto rows = static_cast<Index>(equal.size());
  constexpr int kRounds = 6;
  for (int round = 0; round < kRounds && rows > 0; ++round) {
    std::vector<Eigen::Triplet<double>> slopes;
    Eigen::VectorXd differs(rows);
    for (Index r = 0; r < rows; ++r) {
      const EqualEdges& pair = equal[static_cast<std::size_t>(r)];
      differs[r] = sum_of_lengths(pattern, pair.a) - sum_of_lengths(pattern, pair.b);
      for (const bool of_b : {false, true}) {
        for (const EdgePlace& place : of_b ? pair.b : pair.a) {
          const Panel& panel = pattern.panels[static_cast<std::size_t>(place.panel)];
          const PanelEdge& edge = panel.edges[static_cast<std::size_t>(place.edge)];
          const Vector2 chord = panel.corners.row(edge.end) - panel.corners.row(edge.start);
          const Vector2 slope =
              (of_b ? -1 : 1) * length_at(pattern, place) * chord / chord.squaredNorm();
          const Index columns = first[static_cast<std::size_t>(place.panel)];
          for (Index axis = 0; axis < 2; ++axis) {
            slopes.emplace_back(r, columns + 2 * edge.end + axis, slope[axis]);
            slopes.emplace_back(r, columns + 2 * edge.start + axis, -slope[axis]);
          }
        }
      }
    }
    if (differs.cwiseAbs().maxCoeff() < 1e-6) {
      return;
    }
    // A seam moves the corners of two panels: nearly all of it is zero.
    Eigen::SparseMatrix<double, Eigen::RowMajor> jacobian(rows, first.back());
    jacobian.setFromTriplets(slopes.begin(), slopes.end());
    Eigen::SparseMatrix<double> normal = jacobian * jacobian.transpose();
    Eigen::SparseMatrix<double> contradicting(rows, rows);
    contradicting.setIdentity();
    normal += 1e-6 * contradicting;  // of seams that contradict each other
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
    if (solver.info() != Eigen::Success) {
      return;
    }
    const Eigen::VectorXd step = -(jacobian.transpose() * solver.solve(differs));
    for (std::size_t p = 0; p < pattern.panels.size(); ++p) {
      Panel& panel = pattern.panels[p];
      Points2 corners = panel.corners;
      for (Index c = 0; c < corners.rows(); ++c) {
        corners.row(c) += step.segment<2>(first[p] + 2 * c).transpose();
      }
      move_corners(panel, corners);
    }
  }
}

double run_length(const Points2& vertices, const std::vector<int>& run) {
  double length = 0;
  for (std::size_t i = 1; i < run.size(); ++i) {
    length += (vertices.row(run[i]) - vertices.row(run[i - 1])).norm();
  }
  return length;
}

/// Pieces of a seam each, or the whole of one that is drawn as it is.
std::vector<EqualEdges> equal_edges(const FlatPattern& pattern, const SeamPlaces& places,
                                    const std::vector<int>& ways) {
  std::vector<EqualEdges> equal;
  int last_whole = -1;
  for (const auto& [key, sides] : places) {
    const FlatSeam& seam = pattern.seams[static_cast<std::size_t>(key.first)];
    const double a = run_length(pattern.vertices, seam.a);
    const double b = run_length(pattern.vertices, seam.b);
    if (std::abs(a - b) > kEased * (a + b) / 2) {
      continue;
    }
    const bool whole = std::max(ways[static_cast<std::size_t>(seam.panel_a)],
                                ways[static_cast<std::size_t>(seam.panel_b)]) == kAsItIs;
    if (!whole || last_whole != key.first) {
      equal.emplace_back();
      last_whole = whole ? key.first : -1;
    }
    equal.back().a.push_back(sides[0]);
    equal.back().b.push_back(sides[1]);
  }
  return equal;
}

/// Outlines of the flat panels as vertices, and the panel of each.
struct FlatLoops {
  std::vector<std::vector<int>> loops;
  std::vector<int> panels;
};

SewingPattern drafted(const FlatPattern& pattern, const PatternNames& names,
                      const FlatLoops& outlines, const FitRunsOptions& options,
                      const std::vector<int>& ways) {
  DraftEdges edges;
  for (std::size_t s = 0; s < pattern.seams.size(); ++s) {
    const FlatSeam& seam = pattern.seams[s];
    add_seam(edges, pattern, static_cast<int>(s),
             closeness(options, std::max(ways[static_cast<std::size_t>(seam.panel_a)],
                                         ways[static_cast<std::size_t>(seam.panel_b)])));
  }
  SewingPattern result;
  result.panels.resize(static_cast<std::size_t>(pattern.cut.panel_count));
  SeamPlaces places;
  for (std::size_t i = 0; i < outlines.loops.size(); ++i) {
    const std::vector<int>& loop = outlines.loops[i];
    const int p = outlines.panels[i];
    add_open_runs(edges, pattern, names, loop,
                  closeness(options, ways[static_cast<std::size_t>(p)]));
    Panel& panel = result.panels[static_cast<std::size_t>(p)];
    panel = assembled(edges, loop, p, places);
    panel.name = names.panels[static_cast<std::size_t>(p)];
  }
  if (options.tolerance > 0) {
    equalize_lengths(result, equal_edges(pattern, places, ways));
  }
  for (const auto& [key, sides] : places) {
    result.seams.push_back({names.seams[static_cast<std::size_t>(key.first)], sides[0].panel,
                            sides[0].edge, sides[1].panel, sides[1].edge, true});
  }
  return result;
}

}  // namespace

PatternNames own_names(const FlatPattern& pattern) {
  PatternNames names{pattern.panel_names, {}, {}, {}};
  for (const FlatSeam& seam : pattern.seams) {
    names.seams.push_back(seam.name);
  }
  return names;
}

FlatPattern symmetric_pattern(FlatPattern pattern, double most) {
  if (!(most > 0)) {
    return pattern;
  }
  const std::vector<std::vector<int>> loops =
      boundary_loops(topology_of(pattern.cut.faces, static_cast<Index>(pattern.cut.source.size())));
  std::vector<Points2> outlines;
  for (const std::vector<int>& loop : loops) {
    outlines.push_back(points_of_run(pattern, loop));
  }
  outlines = symmetric_outlines(outlines, most);
  const FlatPattern as_it_is = pattern;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    for (std::size_t k = 0; k < loops[i].size(); ++k) {
      pattern.vertices.row(loops[i][k]) = outlines[i].row(static_cast<Index>(k));
    }
  }
  // What is mirrored about the wrong line, a sleeve's cuff onto its armhole, fits nothing.
  for (const FlatSeam& seam : pattern.seams) {
    const auto differs = [&](const FlatPattern& of) {
      const double a = run_length(of.vertices, seam.a);
      const double b = run_length(of.vertices, seam.b);
      return 2 * std::abs(a - b) / (a + b);
    };
    if (differs(pattern) > std::max(kEased, differs(as_it_is))) {
      return as_it_is;
    }
  }
  return pattern;
}

SewingPattern draft_pattern(const FlatPattern& pattern, const PatternNames& names,
                            const FitRunsOptions& options) {
  ATELIER_CHECK(static_cast<int>(names.panels.size()) == pattern.cut.panel_count &&
                    names.seams.size() == pattern.seams.size(),
                "a name for each panel and each seam");
  const std::vector<int> panel_of = panel_of_vertices(pattern);
  FlatLoops outlines;
  outlines.loops =
      boundary_loops(topology_of(pattern.cut.faces, static_cast<Index>(pattern.cut.source.size())));
  for (const std::vector<int>& loop : outlines.loops) {
    outlines.panels.push_back(panel_of[static_cast<std::size_t>(loop.front())]);
  }
  std::vector<int> ways(static_cast<std::size_t>(pattern.cut.panel_count), 0);
  for (;;) {
    SewingPattern result = drafted(pattern, names, outlines, options, ways);
    bool again = false;
    for (std::size_t p = 0; p < ways.size(); ++p) {
      if (ways[p] < kAsItIs && crosses_itself(panel_outline(result.panels[p]))) {
        ++ways[p];
        again = true;
      }
    }
    if (!again) {
      return result;
    }
  }
}

void place_on_surface(SewingPattern& drafted, const Mesh& mesh, const FlatPattern& pattern) {
  ATELIER_CHECK(static_cast<int>(drafted.panels.size()) == pattern.cut.panel_count,
                "the draft of this pattern");
  const std::vector<int> panel_of = panel_of_vertices(pattern);
  for (std::size_t p = 0; p < drafted.panels.size(); ++p) {
    std::vector<int> own;
    for (std::size_t v = 0; v < panel_of.size(); ++v) {
      if (panel_of[v] == static_cast<int>(p)) {
        own.push_back(static_cast<int>(v));
      }
    }
    Eigen::Matrix3Xd flat = Eigen::Matrix3Xd::Zero(3, static_cast<Index>(own.size()));
    Eigen::Matrix3Xd curved(3, static_cast<Index>(own.size()));
    for (std::size_t i = 0; i < own.size(); ++i) {
      const auto column = static_cast<Index>(i);
      flat.col(column).head<2>() = pattern.vertices.row(own[i]).transpose();
      curved.col(column) =
          mesh.vertices.row(pattern.cut.source[static_cast<std::size_t>(own[i])]).transpose();
    }
    const Eigen::Matrix4d motion = Eigen::umeyama(flat, curved, false);
    const Eigen::AngleAxisd rotation(Eigen::Matrix3d(motion.topLeftCorner<3, 3>()));
    drafted.panels[p].placement.rotation = rotation.angle() * rotation.axis();
    drafted.panels[p].placement.origin = motion.topRightCorner<3, 1>();
  }
}

PatternLayout lay_out_pattern(const FlatPattern& pattern, const PatternPieceOptions& options) {
  return lay_out_pieces(
      draft_pattern(pattern, own_names(pattern), {options.smoothing, options.curve_tolerance}),
      options);
}

}  // namespace atelier
