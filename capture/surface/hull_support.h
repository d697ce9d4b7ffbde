#pragma once

#include <vector>

#include "capture/stereo/stereo.h"
#include "capture/stereo/visual_hull.h"
#include "core/mesh.h"

namespace atelier {

/// Oriented points on the hull's surface where stereo sees nothing: farther than `distance` from
/// every point of `points`, and not in front of the surface of a map that is as sure of it as
/// `min_confidence`. The hull is the outermost place of the surface there, so confidence is 0;
/// colours are those of the nearest of `points`. Our choice. Cost: cells x views.
/// @param points    what stereo is sure of; not empty
/// @param distance  m
Mesh hull_support(const VisualHull& hull, const std::vector<DepthMap>& maps, const Mesh& points,
                  double distance, double min_confidence);

}  // namespace atelier
