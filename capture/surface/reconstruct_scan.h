#pragma once

#include <vector>

#include "capture/surface/instant.h"
#include "core/finding.h"
#include "core/mesh.h"

namespace atelier {

/// A scan and how it came about.
struct ReconstructedScan {
  Mesh scan;    ///< coloured, labelled (255 where no view says) surface; confidence 0: the hull's
  Mesh points;  ///< what the views agree on
  std::vector<DepthMap> maps;     ///< of each view that took part, undistorted
  std::vector<Finding> findings;  ///< what was wrong with views, by their cameras' names
};

/// The surface of one instant: gains of the views (`equalize`), what the views agree on
/// (capture/surface/agreed_points.h, which says what becomes of bad views and throws), Poisson,
/// labels. Where gains cannot be measured for too few shared places, stereo does without
/// brightness (`level_weight` 0).
ReconstructedScan reconstruct_scan(std::vector<InstantView> views,
                                   const ReconstructOptions& options = {},
                                   Device device = Device::Cpu);

}  // namespace atelier
