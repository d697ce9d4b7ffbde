#include "core/laplacian.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "core/error.h"

namespace atelier {
namespace {

constexpr double kFlat = 1e-10;  // height over longest edge

using Triplets = std::vector<Eigen::Triplet<double>>;

void check_surface(const Points& vertices, const Triangles& faces) {
  ATELIER_CHECK(faces.rows() == 0 || (faces.minCoeff() >= 0 && faces.maxCoeff() < vertices.rows()),
                "a face names a vertex that is not there");
  ATELIER_CHECK(vertices.allFinite(), "coordinates must be finite");
}

/// One face: edge k lies opposite of corner k.
struct Face {
  std::array<Eigen::Vector3d, 3> edge;
  double double_area;

  /// Cotangent of the angle at corner k.
  double cotangent(int k) const { return -edge[(k + 1) % 3].dot(edge[(k + 2) % 3]) / double_area; }
  double longest_squared() const {
    return std::max({edge[0].squaredNorm(), edge[1].squaredNorm(), edge[2].squaredNorm()});
  }
  bool degenerate() const { return !(double_area > kFlat * longest_squared()); }
};

Face face_at(const Points& vertices, const Triangles& faces, Index f) {
  Face face;
  for (int k = 0; k < 3; ++k) {
    face.edge[k] = vertices.row(faces(f, (k + 2) % 3)) - vertices.row(faces(f, (k + 1) % 3));
  }
  face.double_area = face.edge[0].cross(face.edge[1]).norm();
  return face;
}

/// True if a face is to be left out; throws where that was not asked for.
bool left_out(const Face& face, Index f, const LaplacianOptions& options) {
  if (!face.degenerate()) {
    return false;
  }
  if (!options.skip_degenerate) {
    throw DataError("", "face " + std::to_string(f), "a height below 1e-10 of its longest edge",
                    "faces with area; remove it, or set skip_degenerate");
  }
  return true;
}

}  // namespace

Eigen::SparseMatrix<double> cotangent_laplacian(const Points& vertices, const Triangles& faces,
                                                const LaplacianOptions& options) {
  check_surface(vertices, faces);
  Triplets triplets;
  triplets.reserve(static_cast<std::size_t>(faces.rows()) * 12);
  for (Index f = 0; f < faces.rows(); ++f) {
    const Face face = face_at(vertices, faces, f);
    if (left_out(face, f, options)) {
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      const int i = faces(f, (k + 1) % 3);
      const int j = faces(f, (k + 2) % 3);
      const double weight = 0.5 * face.cotangent(k);
      triplets.emplace_back(i, j, -weight);
      triplets.emplace_back(j, i, -weight);
      triplets.emplace_back(i, i, weight);
      triplets.emplace_back(j, j, weight);
    }
  }
  Eigen::SparseMatrix<double> laplacian(vertices.rows(), vertices.rows());
  laplacian.setFromTriplets(triplets.begin(), triplets.end());
  return laplacian;
}

Eigen::VectorXd voronoi_areas(const Points& vertices, const Triangles& faces) {
  check_surface(vertices, faces);
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(vertices.rows());
  for (Index f = 0; f < faces.rows(); ++f) {
    const Face face = face_at(vertices, faces, f);
    if (face.degenerate()) {
      // Cells of a face without width: thirds of what area it has.
      for (int k = 0; k < 3; ++k) {
        areas[faces(f, k)] += face.double_area / 6;
      }
      continue;
    }
    int obtuse = -1;
    for (int k = 0; k < 3; ++k) {
      obtuse = face.cotangent(k) < 0 ? k : obtuse;
    }
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const int last = (k + 2) % 3;
      areas[faces(f, k)] += obtuse < 0 ? (face.edge[next].squaredNorm() * face.cotangent(next) +
                                          face.edge[last].squaredNorm() * face.cotangent(last)) /
                                             8
                                       : face.double_area * (obtuse == k ? 0.25 : 0.125);
    }
  }
  return areas;
}

}  // namespace atelier
