#pragma once

#include <vector>

#include "capture/surface/geometric_consistency.h"
#include "core/finding.h"
#include "core/mesh.h"

namespace atelier {

/// A scan and how it came about.
struct ReconstructedScan {
  Mesh scan;    ///< coloured, labelled (255 where no view says); confidence 0: nobody saw it
  Mesh points;  ///< what the views agree on
  std::vector<DepthMap> maps;     ///< of each view that took part, undistorted
  std::vector<Finding> findings;  ///< what was wrong with views, by their cameras' names
};

/// Gives the cameras what their images show. If `options.exposure_compensation`, gains
/// (capture/surface/color_gains.h), as bright together as before; where too few places are shared
/// to measure them, the options are changed so that stereo does without brightness (`level_weight`
/// 0). If `options.align`, poses (capture/surface/refine_cameras.h).
void settle_cameras(std::vector<InstantView>& views, ReconstructOptions& options,
                    Device device = Device::Cpu);

/// The surface of one instant from its views' depth: fusion, Poisson, labels. Throws as
/// consistent_points and surface_from_points.
ReconstructedScan surface_of(const StraightInstant& instant, std::vector<DepthMap> maps,
                             const ReconstructOptions& options = {});

/// All of it: gains, poses, hull, stereo, surface. What becomes of bad views, and what is thrown,
/// is said in capture/surface/geometric_consistency.h.
ReconstructedScan reconstruct_scan(std::vector<InstantView> views,
                                   const ReconstructOptions& options = {},
                                   Device device = Device::Cpu);

}  // namespace atelier
