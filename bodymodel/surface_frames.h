#pragma once

#include <vector>

#include "core/types.h"

namespace atelier {

/// Axes of the surface at each vertex, columns: along an edge, across it, outward normal. They turn
/// with the surface, so that offsets in them can be carried from pose to pose. Fixed axes where
/// there is no face. Throws LogicError where a face names a missing vertex.
std::vector<Eigen::Matrix3d> surface_frames(const Points& vertices, const Triangles& faces);

/// Offsets [V,3] in the axes of each vertex, and back. Throws LogicError unless there is one frame
/// a row.
Points in_surface_frames(const std::vector<Eigen::Matrix3d>& frames, const Points& offsets);
Points from_surface_frames(const std::vector<Eigen::Matrix3d>& frames, const Points& offsets);

}  // namespace atelier
