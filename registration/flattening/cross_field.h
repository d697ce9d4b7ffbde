#pragma once

#include <vector>

#include "core/mesh.h"
#include "core/topology.h"

namespace atelier {

/// Directions of a cross on each face: along the least and the most curvature, and along borders.
/// [F,3] one unit vector in each face; the others are its quarter turns.
///
/// Minimises, over the representation of a cross by its fourth power (a complex number in each
/// face's frame; Knoeppel et al., "Globally optimal direction fields", 2013), the squares of its
/// turns across edges times the square of `reach`, and of its distance from the principal
/// directions, by area and by how far the two curvatures differ. Curvatures are of normals that are
/// smoothed over about `reach` (Rusinkiewicz, "Estimating curvatures and their derivatives on
/// triangle meshes", 2004). Faces at a border lie along it. A sparse factorisation.
///
/// @param reach  m over which creases and folds do not count
Points cross_field(const Mesh& mesh, const Topology& topology, double reach = 0.06);

/// How far each edge runs off the nearest direction of the crosses beside it: sin^2 of twice the
/// angle, 0 along one and 1 halfway between two. [E]
std::vector<double> off_field(const Mesh& mesh, const Topology& topology, const Points& field);

}  // namespace atelier
