#pragma once

#include <span>
#include <vector>

#include "capture/keypoints2d.h"
#include "core/camera.h"
#include "core/types.h"

namespace atelier {

/// Points from one detection of each in every camera, [N,3] m: the least squares of the distances
/// in the images without distortion, weighted by confidence (iterated linear least squares, Hartley
/// and Sturm, "Triangulation", 1997). Every detection counts: for those of a detector, which has
/// outliers, `triangulate_point` is the robust way. NaN where fewer than two cameras see a point,
/// or all rays to it are parallel.
/// @param detections  [C] of [N,3]: pixels and confidence, 0: not seen
/// Throws LogicError for sizes that differ.
Points linear_points(const std::vector<Camera>& cameras, std::span<const Keypoints2d> detections);

}  // namespace atelier
