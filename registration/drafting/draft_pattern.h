#pragma once

#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/pattern_pieces.h"
#include "registration/outlines/fit_runs.h"
#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// Names of a flat pattern's parts, see name_pattern.h.
struct PatternNames {
  std::vector<std::string> panels;    ///< [P]
  std::vector<std::string> seams;     ///< [S]
  std::vector<std::string> openings;  ///< [O] of the garment
  std::vector<int> opening_at;        ///< [C] the one that a vertex borders, -1; or empty
};

/// The names that the flat pattern itself has, and no openings.
PatternNames own_names(const FlatPattern& pattern);

/// The flat pattern with outlines that are mirror images where they nearly are
/// (symmetric_outlines.h): vertices inside stay where they are, so that it is to be drawn, not to
/// be simulated. As it is where that makes the sides of a seam differ by more than 2%, and with
/// `most` 0 m.
FlatPattern symmetric_pattern(FlatPattern pattern, double most);

/// Flat panels as a pattern maker draws them: corners with lines, arcs and cubics between
/// (fit_runs).
///
/// Both sides of a seam have the same number of edges, sewn pair by pair. Pairs whose flat sides
/// differ by less than 2% are made equally long: corners move by the least squares of their
/// displacements that satisfies L_a = L_b, where an edge keeps its shape, so that its length is a
/// multiple of its chord; what differs by more is eased on purpose, and stays. A panel whose
/// outline would cross itself is drawn more closely, and at last as it is, a line for each segment.
/// Our choice. Panels are those of the flat pattern, in their order and place; edges that are not
/// sewn carry the names of their openings.
///
/// `tolerance` 0: a line for each segment of the smoothed outline, sides not made equal.
SewingPattern draft_pattern(const FlatPattern& pattern, const PatternNames& names,
                            const FitRunsOptions& options = {});

/// Places each panel where its part of the surface lies: the rigid motion of least squares from
/// flat to curved vertices (Kabsch 1976). `drafted` must have been made from `pattern`, and that
/// from `mesh`.
void place_on_surface(SewingPattern& drafted, const Mesh& mesh, const FlatPattern& pattern);

/// The pieces of a flat pattern by its own names, drawn and laid out.
PatternLayout lay_out_pattern(const FlatPattern& pattern, const PatternPieceOptions& options = {});

}  // namespace atelier
