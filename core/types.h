#pragma once

#include <Eigen/Core>

namespace atelier {

/// Index of something dense (vertex, face, joint, frame in a sequence). Sparse names are *_id.
using Index = Eigen::Index;

/// Rows are points, normals or rotation vectors; row-major, so that row i is three neighbours.
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// Rows are points of a plane or of a UV square.
using Points2 = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
/// Rows are linear RGB in [0,1].
using Colors = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// Rows are corner indices, counter-clockwise from outside.
using Triangles = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// Rows are the two ends of an edge, the smaller index first.
using Edges = Eigen::Matrix<int, Eigen::Dynamic, 2, Eigen::RowMajor>;

/// True if two arrays have the same size and the same elements; Eigen's == aborts on another size.
template <class Array>
bool equal_arrays(const Array& a, const Array& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && a == b;
}

}  // namespace atelier
