#pragma once

#include <string>
#include <vector>

#include "core/options.h"
#include "registration/flattening/flat_pattern.h"

namespace atelier {

/// A mark on the sew line that meets one on another piece, drawn as a line of `kNotchLength`.
constexpr double kNotchLength = 0.005;  ///< m
struct Notch {
  Eigen::Vector2d position;  ///< m
  Eigen::Vector2d outwards;  ///< unit
  std::string seam;          ///< whose mark it is
};

/// A panel as a pattern maker draws it. Metres, grain along +y.
struct PatternPiece {
  std::string name;
  Points2 sew_line;  ///< closed, counter-clockwise, smoothed where it does not cross itself then
  Points2 cut_line;  ///< with seam allowance
  std::vector<Notch> notches;
  Eigen::Vector2d grain_from, grain_to;  ///< a line inside the piece
};

/// Pieces placed on a strip of fabric: x across it, y along the warp.
struct PatternLayout {
  std::vector<PatternPiece> pieces;
  double width = 0;          ///< m, of the fabric: more than asked for where a piece is wider
  double length = 0;         ///< m, that is used
  double seam_mismatch = 0;  ///< largest difference of smoothed seams, share of their length
};

struct PatternPieceOptions {
  double seam_allowance = 0.01;  ///< m round every piece, 0 to 0.1
  double notch_spacing = 0.12;   ///< m between notches of a seam at least; 0: none
  double smoothing = 0.02;       ///< m along the outline over which it is smoothed; 0: not
  double fabric_width = 1.5;     ///< m, 0.1 to 10
  double gap = 0.01;             ///< m between pieces
};
OptionTable describe(PatternPieceOptions& options);

/// Outlines, seam allowance, notches and grain of every panel, packed onto fabric of a given width
/// in order of their heights, each as low as it goes (skyline, bottom left), turned by at most half
/// a turn, so that the grain stays along the warp. Both sides of a seam are smoothed alike, and as
/// far only as they stay equal in length; ends of seams and corners stay where they are. A panel
/// whose outline would cross itself then is drawn as it is. Our choice of all.
PatternLayout lay_out_pattern(const FlatPattern& pattern, const PatternPieceOptions& options = {});

/// The layout as SVG at true scale: user units are millimetres; layers (Inkscape's) cut, sew,
/// grain, notches, text, and a test square of 100 mm.
std::string pattern_svg(const PatternLayout& layout, const std::string& title);

/// The layout as ASCII DXF R12 in millimetres, in the layers of AAMA (ASTM D6673): 1 cut line, 4
/// notches, 7 grain, 14 sew line, 15 text; one block for each piece, inserted where it lies. Under
/// them, in layer 15, a control square of 100 mm, since programs do not agree on a drawing's unit.
std::string pattern_dxf(const PatternLayout& layout, const std::string& title);

}  // namespace atelier
