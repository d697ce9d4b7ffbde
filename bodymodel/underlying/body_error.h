#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

/// Errors of an underlying body: distance to the ground truth, and from lying under its clothes.
struct BodyError {
  double mean = 0;          ///< m, mean distance of its vertices from the true surface, by area
  double covered_mean = 0;  ///< m, of vertices under clothes in the ground truth
  double vertex_mean = -1;  ///< m, of each vertex from itself; -1 where topologies differ
  double vertex_covered_mean = -1;  ///< m, of those under clothes
  Index covered = 0;                ///< vertices under clothes
  double outside_rate = 0;          ///< share of them more than 1 mm outside of the true clothes
  double outside_depth = 0;         ///< m, mean depth of those
  Index close = 0;                  ///< vertices with a true gap below 1 cm
  double proximity = 0;             ///< m, mean error of the gap there
  double proximity_bias = 0;        ///< m, mean of the gap less the true one there
};

/// A vertex is what the nearest point of the true body is: under clothes if that point sees a
/// garment from inside along its normal, or has one within 5 cm. Gaps are signed distances from
/// garments (nearest of several), where those have no rim. Layers count each on its own.
/// Throws LogicError where faces name missing vertices; O((V + F) log F).
/// @param garments  ground-truth surfaces of clothes, facing outwards
BodyError body_error(const Triangles& faces, const Points& vertices, const Mesh& true_body,
                     const std::vector<Mesh>& garments);

}  // namespace atelier
