#pragma once

#include <vector>

#include "core/topology.h"
#include "core/types.h"
#include "registration/edge_paths.h"
#include "registration/flattening/find_seams.h"

namespace atelier {

/// A panel while seams are sought: a disk with its flat shape. Private to registration.
struct SeamPiece {
  Points vertices;
  Triangles faces;
  std::vector<int> of_face;  ///< face of the whole mesh
  Topology topology;
  std::vector<double> bends;  ///< [V] smoothed curvature of the whole surface, see find_seams.cpp
  Points2 flat;               ///< [V,2] or empty
  Eigen::VectorXd areas, strain;  ///< [F]
  bool overlaps = false;
  double excess = 0;  ///< what of it is stretched too far; 0 is perfect
};

/// Flattens it from its current state (or from scratch) and measures the stretch that counts
/// (counted_strain). `iterations` of Newton's method at most.
void lay_flat(SeamPiece& piece, const FindSeamsOptions& find, int iterations, double tolerance);

/// Corners of its flat outline: turns by more than 35 degrees over 3 cm to either side.
int corners_of(const SeamPiece& piece);

/// The disks that a cut along some of its edges leaves of a piece, with its flat shape to go on
/// from.
std::vector<SeamPiece> parts_of(const SeamPiece& piece, const std::vector<char>& cut);

/// Ways to cut a piece: sets of edges, darts and through cuts, from its most stretched places.
/// `costs` per edge.
std::vector<std::vector<int>> ways_to_cut(const SeamPiece& piece, const std::vector<double>& sides,
                                          double bound);

}  // namespace atelier
