#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/options.h"
#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// A mark on the sew line that meets one on another piece, drawn as a line of `kNotchLength`.
constexpr double kNotchLength = 0.005;  ///< m
struct Notch {
  Eigen::Vector2d position;  ///< m
  Eigen::Vector2d outwards;  ///< unit
  std::string seam;          ///< whose mark it is
};

/// The name of a seam or an opening beside its edge.
struct EdgeLabel {
  std::string text;
  Eigen::Vector2d position;  ///< m
  Eigen::Vector2d along;     ///< unit, the edge's direction, counter-clockwise round the piece
};

/// A panel as a pattern maker draws it. Metres, grain along +y.
struct PatternPiece {
  std::string name;
  Points2 sew_line;  ///< closed, counter-clockwise
  Points2 cut_line;  ///< with seam and hem allowance
  std::vector<Notch> notches;
  std::vector<EdgeLabel> labels;
  Eigen::Vector2d grain_from, grain_to;  ///< a line inside the piece
  /// Ends of the line about which the piece is its own mirror image, along the grain, if there is
  /// one.
  std::optional<std::pair<Eigen::Vector2d, Eigen::Vector2d>> fold;
};

/// Pieces placed on a strip of fabric: x across it, y along the warp.
struct PatternLayout {
  std::vector<PatternPiece> pieces;
  double width = 0;          ///< m, of the fabric: more than asked for where a piece is wider
  double length = 0;         ///< m, that is used
  double seam_mismatch = 0;  ///< largest difference of drawn seams, share of their length
};

struct PatternPieceOptions {
  double seam_allowance = 0.01;    ///< m, 0 to 0.1
  double hem_allowance = 0.02;     ///< m at openings named hem or cuff, 0 to 0.2
  double notch_spacing = 0.12;     ///< m between notches of a seam at least; 0: none
  double smoothing = 0.02;         ///< m along the outline over which it is smoothed; 0: not
  double curve_tolerance = 0.003;  ///< m that drawn curves keep to it, 0 to 0.05; 0: segments
  double symmetry = 0.01;          ///< m off its mirror image, rms, at which a panel becomes it
  double fabric_width = 1.5;       ///< m, 0.1 to 10
  double gap = 0.01;               ///< m between pieces
};
OptionTable describe(PatternPieceOptions& options);

/// Whether an edge borders an opening with a hem's allowance, by its name.
bool is_hem(const PanelEdge& edge);

/// Outlines, allowances, notches, grain, fold and labels of every panel, packed onto fabric of a
/// given width in order of their heights, each as low as it goes (skyline, bottom left), turned by
/// at most half a turn, so that the grain stays along the warp. Notches divide a seam evenly, at
/// the same share of both sides. A piece that is its own mirror image within 3 mm has a fold. Our
/// choice of all.
PatternLayout lay_out_pieces(const SewingPattern& pattern, const PatternPieceOptions& options = {});

/// The layout as SVG at true scale: user units are millimetres; layers (Inkscape's) cut, sew,
/// grain, notches, text, and a test square of 100 mm.
std::string pattern_svg(const PatternLayout& layout, const std::string& title);

/// The layout as ASCII DXF R12 in millimetres, in the layers of AAMA (ASTM D6673): 1 cut line, 4
/// notches, 6 mirror line, 7 grain, 14 sew line, 15 text; one block for each piece, inserted where
/// it lies. Under them, in layer 15, a control square of 100 mm, since programs do not agree on a
/// drawing's unit.
std::string pattern_dxf(const PatternLayout& layout, const std::string& title);

}  // namespace atelier
