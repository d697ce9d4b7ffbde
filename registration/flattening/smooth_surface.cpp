#include "registration/flattening/smooth_surface.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/laplacian.h"
#include "core/topology.h"
#include "registration/rim_vertices.h"

namespace atelier {

Points smoothed_surface(const Mesh& mesh, double reach) {
  ATELIER_CHECK(reach >= 0, "a reach that is not negative");
  if (reach == 0 || mesh.faces.rows() == 0) {
    return mesh.vertices;
  }
  using Sparse = Eigen::SparseMatrix<double>;
  const Sparse laplacian =
      cotangent_laplacian(mesh.vertices, mesh.faces, {.skip_degenerate = true});
  const Eigen::VectorXd areas = voronoi_areas(mesh.vertices, mesh.faces).cwiseMax(1e-12);
  Eigen::VectorXd inner = areas.cwiseInverse();
  const std::vector<char> rim = rim_vertices(topology_of(mesh.faces, mesh.vertices.rows()));
  for (Index v = 0; v < inner.size(); ++v) {
    inner[v] *= rim[static_cast<std::size_t>(v)] != 0 ? 0 : 1;
  }
  Sparse system =
      std::pow(reach, 4) * (laplacian.transpose() * inner.asDiagonal() * laplacian).eval();
  for (Index v = 0; v < areas.size(); ++v) {
    system.coeffRef(v, v) += areas[v];
  }
  const Eigen::SimplicialLDLT<Sparse> solver(system);
  if (solver.info() != Eigen::Success) {
    return mesh.vertices;
  }
  Points smooth(mesh.vertices.rows(), 3);
  for (int d = 0; d < 3; ++d) {
    const Eigen::VectorXd column = solver.solve(areas.cwiseProduct(mesh.vertices.col(d)));
    smooth.col(d) = column;
  }
  return smooth;
}

}  // namespace atelier
