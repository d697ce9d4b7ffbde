#pragma once

#include "core/mesh.h"

namespace atelier {

/// True if a triangle has no area: its height is under 1e-7 of its longest edge, or a number is not
/// finite.
bool is_without_area(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// The mesh without triangles that are nothing of its surface: those with a vertex twice, those
/// that are there twice (the first stays), and those without area at the rim, where what is left
/// hangs together as before. Triangles without area elsewhere stay: what lies around them is moved
/// (remove_slivers.h). The others keep their order, vertices and texture coordinates their numbers.
/// O(F log F) for each layer of such triangles.
Mesh without_needless_triangles(const Mesh& mesh);

}  // namespace atelier
