#pragma once

#include <vector>

#include "core/camera.h"

namespace atelier {

/// For each camera the others that it is best compared with, best first: those that look at the
/// centre from 5 to 30 degrees away come first, near 15 best (smaller angles know little of depth,
/// at larger ones windows look different); then by angle up to 80 degrees. Our choice of the curve,
/// after Schoenberger 2016.
/// @param centre  metres: where the subject stands
/// @param count   at most so many for each
std::vector<std::vector<int>> choose_sources(const std::vector<Camera>& cameras,
                                             const Eigen::Vector3d& centre, int count);

/// The point nearest to all optical axes (least squares), metres: where cameras of a stage look.
/// Falls back to the point 1 m in front of the mean camera where the axes are parallel.
Eigen::Vector3d looked_at(const std::vector<Camera>& cameras);

}  // namespace atelier
