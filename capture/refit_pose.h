#pragma once

#include <vector>

#include "core/camera.h"
#include "core/types.h"

namespace atelier {

/// A point in space and the pixel at which a camera found it.
struct Sighting {
  Eigen::Vector3d place;
  Eigen::Vector2d pixel;
};

/// The pose nearest to a camera's own under which it sees the points where it found them: least sum
/// of distances, by Gauss-Newton with weights 1 / distance (Weiszfeld), so that some wild ones do
/// not matter. Where the points are behind it or too few (six) the camera is as it was. O(points).
Camera refit_pose(Camera camera, const std::vector<Sighting>& sightings);

}  // namespace atelier
