#pragma once

#include <vector>

#include "core/mesh.h"
#include "registration/flattening/seam_piece.h"

namespace atelier {

/// The middle plane of a garment that is its own mirror image: points x with x . left = middle.
struct MirrorPlane {
  Eigen::Vector3d left = Eigen::Vector3d::UnitX();
  double middle = 0;   ///< m
  bool holds = false;  ///< half of the mirrored vertices lie within 1.5 cm of the surface
};

/// The plane halfway between the outermost places to the left and to the right of a wearer who
/// looks to `facing`. Private to registration, as the rest of this file.
MirrorPlane mirror_plane(const Mesh& mesh, const Eigen::Vector3d& facing);

/// The vertices of a chain of edges from one end to the other; empty where they are no chain.
std::vector<int> chain_of(const Topology& topology, const std::vector<int>& edges);

/// A way through one of the pieces that runs where a chain of places, mirrored, does.
struct MirroredWay {
  std::size_t piece = 0;
  std::vector<int> edges;  ///< of the piece; none where there is no such way
};

/// The shortest way near the mirrored chain, from rim to rim of a piece, or, of a chain whose last
/// end is not `to_rim`, from its rim into it. None where it strays by more than 2 cm in the mean,
/// and of a chain that is its own mirror image, to 1.5 cm in the mean, or whose image is a rim.
///
/// @param chain  [N,3] m, N at least 2; the first end is at a rim
MirroredWay mirrored_way(const std::vector<SeamPiece>& pieces, const MirrorPlane& plane,
                         const Points& chain, bool to_rim);

}  // namespace atelier
