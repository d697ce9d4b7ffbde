#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace atelier {

/// One number over frames.
struct FramePlot {
  std::string label;           ///< "distance to the scan, mm rms"
  std::vector<int> frame_ids;  ///< [F], increasing
  std::vector<double> values;  ///< [F], finite
};

/// Small plots side by side, a line over frames each, from 0 or their least value to their largest,
/// which are written beside it: one SVG, as HTML holds it. "" for no plots or none with a frame.
std::string plots_svg(const std::vector<FramePlot>& plots);

/// Some of many: every n-th of a plot's points, so that about so many are left.
FramePlot thinned(const FramePlot& all, std::size_t about);

}  // namespace atelier
