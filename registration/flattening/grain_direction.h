#pragma once

#include "core/types.h"

namespace atelier {

/// Where the grain (warp) lies in a flat panel, a unit vector: where the world's up (+y) lies on
/// most of the panel by area; along its longest direction where up is nowhere (less than 0.3 of the
/// area has it).
/// @param vertices  [V,3] m, the panel on the body
/// @param flat      [V,2] m, the same laid flat
Eigen::Vector2d grain_direction(const Points& vertices, const Triangles& faces,
                                const Points2& flat);

/// The flat panel turned so that its grain is +y.
Points2 turned_to_grain(const Points& vertices, const Triangles& faces, const Points2& flat);

/// Deformation of a face from flat to curved: where x and y go, in space. [3,2]
Eigen::Matrix<double, 3, 2> face_deformation(const Points& curved, const Triangles& curved_faces,
                                             const Points2& flat, const Triangles& flat_faces,
                                             Index face);

}  // namespace atelier
