#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "core/camera.h"
#include "core/mesh.h"
#include "core/types.h"

namespace atelier {

/// A true surface as points: what a reconstruction could have found.
struct SurfaceSamples {
  Points points;                     ///< [N,3] metres, even over the area
  Points normals;                    ///< [N,3] outward
  std::vector<std::uint8_t> labels;  ///< [N] or empty
  double seen_area = 0;              ///< m2 of the part that they stand for
  double area = 0;                   ///< m2 of the whole
};

/// Samples of the part of a surface that at least two cameras see: from outside, within 70 degrees
/// of its normal, inside the image, not hidden by the surface itself.
/// @param spacing  m between neighbours, on average
SurfaceSamples seen_surface(const Mesh& truth, const std::vector<Camera>& cameras,
                            double spacing = 0.005);

/// How far a scan is from a true surface.
struct SurfaceError {
  double chamfer = 0;       ///< m: mean of `accuracy` and `from_truth`
  double accuracy = 0;      ///< m, mean distance of the scan's surface from the ground truth
  double from_truth = 0;    ///< m, mean distance of the seen ground truth from the scan
  double completeness = 0;  ///< share of the seen ground truth within 5 mm of the scan
  double floating = 0;      ///< share of the scan's area more than 2 cm off the ground truth
  double label_iou = 0;  ///< mean over labels, of the seen ground truth by the nearest scan vertex;
                         ///< 0 where there are no labels
  std::map<std::uint8_t, double> completeness_of;  ///< of the true points of each label
};

/// @param seen  of `truth`
/// Throws DataError for a scan without faces, LogicError for empty samples.
SurfaceError surface_error(const Mesh& scan, const Mesh& truth, const SurfaceSamples& seen);

}  // namespace atelier
