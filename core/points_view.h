#pragma once

#include <limits>
#include <vector>

#include "core/device.h"
#include "core/tree.h"
#include "core/types.h"

namespace atelier {

/// Points in memory that somebody else owns, such as an array of NumPy: row after row, without
/// gaps. Valid as long as that memory is.
using PointsView = Eigen::Map<const Points>;

inline PointsView view_of(const Points& points) {
  return {points.data(), points.rows(), 3};
}

// The functions of core/normals.h and core/tree.h of the same names, without a copy of the points.

Points vertex_normals(PointsView vertices, const Triangles& faces);

std::vector<ClosestPoint> closest_points(
    const TriangleTree& tree, PointsView queries,
    double max_distance = std::numeric_limits<double>::infinity(), Device device = Device::Cpu);

TriangleTree refit_tree(TriangleTree tree, PointsView vertices);

}  // namespace atelier
