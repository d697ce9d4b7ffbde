#pragma once

#include <vector>

#include "capture/surface/instant.h"
#include "core/device.h"
#include "core/options.h"

namespace atelier {

/// The surface as shrunk images show it: what gains and poses are measured by.
struct CoarseReconstruction {
  std::vector<InstantView> views;  ///< shrunk; their gains are 1
  std::vector<SeenPlace> places;   ///< views are numbered as in `views`
};

struct CoarseReconstructionOptions {
  int longest_side = 500;       ///< px that images are shrunk to before stereo, 64 to 4096
  double max_view_angle = 0.8;  ///< rad between normal and view beyond which a view is not asked
  double depth_error = 0.01;  ///< relative difference to a view's own depth that is still the place
  int max_points = 20000;     ///< of one instant, spread evenly, 100 to 1e6
};
OptionTable describe(CoarseReconstructionOptions& options);

/// Places of the surface that several views agree on (stereo and fusion of one instant, on shrunk
/// images), with the views that see them: those whose own depth map has the place, also one pixel
/// further on each side, so that nothing comes from beyond an edge. Brightness is not compared
/// (`level_weight` 0), as gains are not known yet. Throws as consistent_points.
CoarseReconstruction coarse_reconstruction(const std::vector<InstantView>& views,
                                           const ReconstructOptions& reconstruct = {},
                                           const CoarseReconstructionOptions& options = {},
                                           Device device = Device::Cpu);

}  // namespace atelier
