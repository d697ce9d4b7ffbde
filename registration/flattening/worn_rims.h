#pragma once

#include <limits>
#include <vector>

#include "core/mesh.h"
#include "core/topology.h"

namespace atelier {

/// A boundary loop on the wearer.
struct RimLoop {
  std::vector<int> vertices;  ///< in the direction of the faces' edges
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double left = 0;  ///< m off the middle, positive to the wearer's left
  double low = std::numeric_limits<double>::infinity();  ///< m, the least y
};

/// Which loops arms and legs come out of, and which lie in the middle: places in a list.
struct LimbLoops {
  std::vector<std::size_t> arms, legs, central;
};

/// The openings of a garment on its wearer.
struct WornRims {
  Eigen::Vector3d left = Eigen::Vector3d::UnitX();
  double middle = 0;
  std::vector<RimLoop> loops;
  LimbLoops limbs;
};

/// The openings of a garment whose wearer looks to `facing`. Private to registration, as the rest
/// of this file.
///
/// Arms and legs come out of openings beside the middle in pairs. The upper pair are arms unless no
/// opening in the middle lies as low, and there is one such pair and one waist. Our choice.
///
/// @param facing  where the wearer looks, of length 1; LogicError otherwise
WornRims worn_rims(const Mesh& mesh, const Topology& topology, const Eigen::Vector3d& facing);

}  // namespace atelier
