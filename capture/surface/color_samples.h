#pragma once

#include <vector>

#include "capture/surface/color_gains.h"
#include "capture/surface/instant.h"

namespace atelier {

struct ColorSampleOptions {
  int longest_side = 500;     ///< px that pictures are shrunk to before stereo, 64 to 4096
  double steepest = 0.8;      ///< rad between normal and view beyond which a view is not asked
  double depth_error = 0.01;  ///< relative difference to a view's own depth that is still the place
  int most_points = 20000;    ///< of one instant, spread evenly, 100 to 1e6
};
OptionTable describe(ColorSampleOptions& options);

/// Places of the surface that several views agree on (stereo and fusion of one instant), with the
/// colour that each view's picture has there: as taken, gain not removed; cameras are numbered as
/// in `views`. A view is asked only if its own depth map has the place, also one pixel further on
/// each side, so that colours do not come from beyond an edge. Brightness is not compared
/// (`level_weight` 0), as gains are not known yet. Throws as agreed_points.
std::vector<ColorSample> color_samples(const std::vector<InstantView>& views,
                                       const ReconstructOptions& reconstruct = {},
                                       const ColorSampleOptions& options = {},
                                       Device device = Device::Cpu);

}  // namespace atelier
