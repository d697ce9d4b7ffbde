#pragma once

#include <vector>

#include "capture/stereo/stereo.h"
#include "core/image.h"
#include "core/mesh.h"
#include "core/options.h"

namespace atelier {

struct FuseOptions {
  int min_views = 2;            ///< that must agree on a point, itself included
  double pixel_error = 1.5;     ///< px: how far a pixel may land from itself there and back
  double depth_error = 0.008;   ///< relative difference of depths
  double normal_error = 0.7;    ///< rad between the views' normals
  double min_confidence = 0.1;  ///< of a pixel that takes part
};
OptionTable describe(FuseOptions& options);

/// Oriented coloured points on which views agree, as a mesh without faces: positions, normals,
/// colours and confidence (mean of the views', lower where few agree). Each pixel belongs to one
/// point at most (Schoenberger 2016, section 6; one step of the chain instead of the whole).
///
/// @param maps    of all views of one instant
/// @param images  [H,W,3] linear RGB of the same undistorted cameras, or empty: no colours
/// Throws LogicError for sizes that differ. Cost: pixels x views; the order of the points is that
/// of views and pixels.
Mesh fuse(const std::vector<DepthMap>& maps, const std::vector<Image>& images,
          const FuseOptions& options = {});

}  // namespace atelier
