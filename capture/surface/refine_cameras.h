#pragma once

#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/options.h"

namespace atelier {

struct RefineCameraOptions {
  int search = 3;             ///< px each way that a patch is looked for, 1 to 16
  int points = 3000;          ///< that are looked for, spread evenly, 100 to 1e6
  double correlation = 0.85;  ///< of a patch with the one that it is found by, at least
};
OptionTable describe(RefineCameraOptions& options);

/// A place of the surface and the views that have it.
struct SeenPlace {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< m
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< outward
  std::vector<int> views;                             ///< increasing
};

/// Cameras that agree better.
struct RefinedCameras {
  std::vector<Camera> cameras;  ///< poses changed, lenses kept
  std::vector<int> matches;     ///< places by which each was found
  double before = 0;            ///< px, median distance of places in images from their projection
  double after = 0;             ///< the same after
};

/// Poses again, from the images of the surface itself (after Furukawa and Ponce 2009): the patch
/// round each place, as the view that faces it most has it, is looked for in the other views to a
/// fraction of a pixel, and poses and places are adjusted to what was found (bundle adjustment,
/// Gauss-Newton with the places eliminated, Cauchy's loss). The calibration is a prior, as wide as
/// calibrations are off by what was found: cameras stay together where they were, and one that
/// shares too little stays. Patches without texture and such as fit at two places are not used. Our
/// choice of patch and weights.
///
/// @param images  [H,W,1] of each camera, as taken, brightness about evenly noisy
/// @return the cameras as they were where fewer than 100 places were found in two views
/// Throws LogicError for sizes that differ and views out of range. Cost: some 10,000 samples a
/// place and view.
RefinedCameras refine_cameras(const std::vector<Camera>& cameras, const std::vector<Image>& images,
                              const std::vector<SeenPlace>& places,
                              const RefineCameraOptions& options = {});

}  // namespace atelier
