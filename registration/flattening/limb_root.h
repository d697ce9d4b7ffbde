#pragma once

#include "core/mesh.h"
#include "core/topology.h"
#include "registration/edge_paths.h"

namespace atelier {

/// Where a limb meets the trunk.
struct LimbRoot {
  int vertex = -1;  ///< the armpit, or the crotch; -1: there is none
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of what lies as far from the opening
};

/// The place of most negative curvature where the loops at one distance from an opening begin to
/// grow as they do on a trunk, by their distance or more. None where the limb is shorter than 4 cm.
/// Our choice. Private to registration.
///
/// @param paths  along edges from the vertices of the opening, m
LimbRoot limb_root(const Mesh& mesh, const Topology& topology, const EdgePaths& paths);

}  // namespace atelier
