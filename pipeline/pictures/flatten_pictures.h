#pragma once

#include "core/image.h"
#include "core/mesh.h"
#include "registration/flattening/flat_pattern.h"

namespace atelier {

/// The surface from two sides and its flat panels, each triangle in the colour of its stretch.
/// Linear RGB.
/// @param facing  where its wearer looks, horizontal; zero: nobody knows, and sides are called
///                after where they are seen from
Image stretch_picture(const Mesh& mesh, const FlatPattern& pattern, const FlatMeasures& measures,
                      const Eigen::Vector3d& facing);

/// A pattern sewn anew, each point in the colour of its distance from the captured garment, and
/// that, both on their body from two sides. Linear RGB.
/// @param off  [V] m, distance of each vertex of `sewn`
Image sewn_picture(const Mesh& sewn, const Mesh& captured, const Mesh& body,
                   const Eigen::VectorXd& off, const Eigen::Vector3d& facing);

}  // namespace atelier
