#pragma once

#include <vector>

#include "capture/surface/geometric_consistency.h"
#include "core/finding.h"
#include "core/mesh.h"

namespace atelier {

/// A scan with its intermediate results.
struct ReconstructedScan {
  Mesh scan;                   ///< coloured, labelled (255: unknown); confidence 0: seen by no view
  Mesh points;                 ///< oriented points on which the views agree
  std::vector<DepthMap> maps;  ///< of each view used, undistorted
  std::vector<Finding> findings;  ///< defects of views, by the names of their cameras
};

/// Refines the cameras from their images. If `options.exposure_compensation`, it estimates gains
/// (capture/surface/color_gains.h) with the mean brightness unchanged; where the views share too
/// few points for that, the options are changed so that stereo ignores brightness (`level_weight`
/// 0). If `options.align`, it refines poses (capture/surface/refine_cameras.h).
void settle_cameras(std::vector<InstantView>& views, ReconstructOptions& options,
                    Device device = Device::Cpu);

/// The surface of one instant from its depth maps: fusion, Poisson reconstruction, labels. Throws
/// as consistent_points and surface_from_points.
ReconstructedScan surface_of(const StraightInstant& instant, std::vector<DepthMap> maps,
                             const ReconstructOptions& options = {});

/// The whole reconstruction: gains, poses, visual hull, stereo, surface. Treatment of bad views and
/// exceptions: see capture/surface/geometric_consistency.h.
ReconstructedScan reconstruct_scan(std::vector<InstantView> views,
                                   const ReconstructOptions& options = {},
                                   Device device = Device::Cpu);

}  // namespace atelier
