#pragma once

#include <vector>

#include "capture/stereo/fuse.h"
#include "capture/stereo/stereo.h"
#include "capture/stereo/visual_hull.h"
#include "capture/surface/surface_from_points.h"
#include "capture/surface/surface_labels.h"
#include "core/camera.h"
#include "core/finding.h"
#include "core/image.h"
#include "core/mesh.h"

namespace atelier {

/// What one camera saw at one instant, as taken: with distortion.
struct InstantView {
  Camera camera;     ///< gain included: images are divided by it
  Image image;       ///< [H,W,3] linear RGB
  ByteImage mask;    ///< [H,W] not 0: the subject; empty: known nowhere
  ByteImage labels;  ///< [H,W] numbers of the taxonomy, or empty
};

struct ReconstructOptions {
  VisualHullOptions hull;
  StereoOptions stereo;
  FuseOptions fuse;
  SurfaceOptions surface;
  SurfaceLabelOptions labels;
  bool hull_support = false;  ///< close what stereo sees nothing of by the hull, with confidence 0
};
OptionTable describe(ReconstructOptions& options);

/// A scan and how it came about.
struct ReconstructedScan {
  Mesh scan;    ///< coloured, labelled (255 where no view says) surface; confidence 0: the hull's
  Mesh points;  ///< what the views agree on
  std::vector<DepthMap> maps;     ///< of each view that took part, undistorted
  std::vector<Finding> findings;  ///< what was wrong with views, by their cameras' names
};

/// The surface of one instant: hull from the masks, stereo within it, fusion, Poisson, labels.
/// What is wrong with a view is said and does no harm: it is left out if it is black ("view-black")
/// or its mask is empty ("view-mask-empty"); a mask that is inverted is turned round
/// ("view-mask-inverted"), one that contradicts the others is not used ("view-mask-off"); the depth
/// of a view that others do not confirm, as of one that is calibrated wrongly, is left out
/// ("view-disagrees"). Throws DataError if fewer than two views are left or the
/// views agree on fewer than 100 points; LogicError for sizes that differ.
ReconstructedScan reconstruct_scan(const std::vector<InstantView>& views,
                                   const ReconstructOptions& options = {},
                                   Device device = Device::Cpu);

}  // namespace atelier
