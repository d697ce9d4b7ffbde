#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/row/key_figure.h"

namespace atelier {

/// One number over frames.
struct FramePlot {
  std::string label;           ///< "distance to the scan, mm rms"
  std::vector<int> frame_ids;  ///< [F], increasing
  std::vector<double> values;  ///< [F], finite
  /// What the values should stay below or above, a line; NaN: nothing
  double target = std::numeric_limits<double>::quiet_NaN();
};

/// Small plots side by side, a line over frames each, from 0 or their least value to their largest,
/// which are written beside it, and a dashed line at the target: one SVG, as HTML holds it. "" for
/// no plots or none with a frame.
std::string plots_svg(const std::vector<FramePlot>& plots);

/// The limit of a metric times `scale`, as a target; NaN where it has none.
double scaled_limit(std::span<const KeyFigure> figures, std::string_view metric, double scale);

/// Some of many: every n-th of a plot's points, so that about so many are left.
FramePlot thinned(const FramePlot& all, std::size_t about);

}  // namespace atelier
