#pragma once

#include "core/types.h"

namespace atelier {

/// Depth, metres, of each point inside a closed surface: distance to the surface for points whose
/// winding number is above one half; 0 outside, where the surface overlaps itself (winding number
/// above one and a half: an armpit, a bent knee, where cloth has nowhere to go) and within `room`
/// metres of there. O(points log faces), and O(faces within `room` x log faces) for those inside.
Eigen::VectorXd depths_inside(const Points& points, const Points& vertices, const Triangles& faces,
                              double room = 0);

}  // namespace atelier
