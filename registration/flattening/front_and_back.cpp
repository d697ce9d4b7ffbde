#include "registration/flattening/front_and_back.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/normals.h"
#include "core/topology.h"
#include "registration/edge_paths.h"
#include "registration/flattening/surface_cut.h"
#include "registration/minimum_cut.h"

namespace atelier {
namespace {

/// Normals of faces, times `along` [3,K], smoothed: (area + reach^2 L) z = area z0, with the graph
/// Laplacian of neighbouring faces, which no triangle's shape can upset. [F,K]
Eigen::MatrixXd smooth_facing(const Mesh& mesh, const Triangles& neighbors,
                              const Eigen::VectorXd& areas, const Eigen::MatrixXd& along,
                              double reach) {
  const Index faces = mesh.faces.rows();
  const Points normals = face_normals(mesh.vertices, mesh.faces);
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd right(faces, along.cols());
  for (Index f = 0; f < faces; ++f) {
    const double own = std::max(areas[f], 1e-12);
    right.row(f) = own * normals.row(f) * along;
    double sum = own;
    for (int k = 0; k < 3; ++k) {
      if (neighbors(f, k) >= 0) {
        sum += reach * reach;
        entries.emplace_back(f, neighbors(f, k), -reach * reach);
      }
    }
    entries.emplace_back(f, f, sum);
  }
  Eigen::SparseMatrix<double> system(faces, faces);
  system.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
  return solver.solve(right);
}

/// Two sides of least cost: 1 in front.
std::vector<int> cut_in_two(const Topology& topology, const Eigen::VectorXd& facing,
                            const Eigen::VectorXd& areas, const std::vector<double>& lengths,
                            double reach) {
  const auto faces = static_cast<std::size_t>(topology.faces.rows());
  std::vector<double> in_front(faces);
  std::vector<double> at_the_back(faces);
  for (std::size_t f = 0; f < faces; ++f) {
    const double weight = facing[static_cast<Index>(f)] * areas[static_cast<Index>(f)];
    in_front[f] = std::max(0.0, -weight);
    at_the_back[f] = std::max(0.0, weight);
  }
  std::vector<CutLink> links;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto sharing = corners_of_edge(topology, e);
    if (sharing.size() == 2) {
      links.push_back({static_cast<std::size_t>(sharing[0] / 3),
                       static_cast<std::size_t>(sharing[1] / 3),
                       reach * lengths[static_cast<std::size_t>(e)]});
    }
  }
  const std::vector<char> sides = minimum_cut(in_front, at_the_back, links);
  return {sides.begin(), sides.end()};
}

}  // namespace

Eigen::Vector3d nearly_ahead(const Eigen::Vector3d& facing) {
  constexpr double kNearly = 0.9848;  // cosine of 10 degrees
  return facing.z() > kNearly ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : facing;
}

Eigen::Vector3d facing_of(const Mesh& mesh, double reach) {
  constexpr double kRound = 0.15;  // difference of the axes, of 2 at most
  ATELIER_CHECK(reach > 0, "a reach of more than zero");
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  const Triangles neighbors = face_neighbors(topology_of(mesh.faces, mesh.vertices.rows()));
  Eigen::Matrix<double, 3, 2> along_ground;
  along_ground << Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ();
  const Eigen::MatrixXd normals = smooth_facing(mesh, neighbors, areas, along_ground, reach);
  Eigen::MatrixXd middles(mesh.faces.rows(), 2);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    middles.row(f) = (mesh.vertices.row(mesh.faces(f, 0)) + mesh.vertices.row(mesh.faces(f, 1)) +
                      mesh.vertices.row(mesh.faces(f, 2))) /
                     3 * along_ground;
  }
  middles.rowwise() -= Eigen::RowVector2d(areas.transpose() * middles / areas.sum());
  const auto shares = [&](const Eigen::MatrixXd& rows) {
    const Eigen::Matrix2d spread = rows.transpose() * areas.asDiagonal() * rows;
    return Eigen::Matrix2d(spread / std::max(spread.trace(), 1e-12));
  };
  const auto axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>().computeDirect(shares(normals) -
                                                                                   shares(middles));
  const Eigen::Vector2d eigenvalues = axes.eigenvalues();  // increasing
  Eigen::Vector2d axis = axes.eigenvectors().col(1);
  constexpr double kSideways = 1e-6;
  if (axis.y() < -kSideways || (axis.y() < kSideways && axis.x() < 0)) {
    axis = -axis;
  }
  const bool round = !(eigenvalues[1] - eigenvalues[0] > kRound);
  return round ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : nearly_ahead({axis.x(), 0, axis.y()});
}

std::vector<char> front_and_back(const Mesh& mesh, const Eigen::Vector3d& front, double reach) {
  ATELIER_CHECK(reach > 0, "a reach of more than zero");
  ATELIER_CHECK(std::abs(front.norm() - 1) < 1e-6, "a direction of length 1");
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const Triangles neighbors = face_neighbors(topology);
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  const Eigen::VectorXd facing = smooth_facing(mesh, neighbors, areas, front, reach);
  const std::vector<double> lengths = edge_lengths(topology, mesh.vertices);
  std::vector<int> sides = cut_in_two(topology, facing, areas, lengths, reach);
  // Small pieces go to the other side, with what surrounds them.
  for (int round = 0; round < 8; ++round) {
    const SurfaceCut cut = cut_surface(topology, cut_between_labels(topology, sides));
    std::vector<double> sizes(static_cast<std::size_t>(cut.panel_count), 0);
    for (Index f = 0; f < mesh.faces.rows(); ++f) {
      sizes[static_cast<std::size_t>(cut.panels[static_cast<std::size_t>(f)])] += areas[f];
    }
    std::size_t smallest = sizes.size();
    for (std::size_t p = 0; p < sizes.size(); ++p) {
      if (sizes[p] < areas.sum() / 30 && (smallest == sizes.size() || sizes[p] < sizes[smallest])) {
        smallest = p;
      }
    }
    if (smallest == sizes.size()) {
      break;
    }
    for (std::size_t f = 0; f < sides.size(); ++f) {
      if (cut.panels[f] == static_cast<int>(smallest)) {
        sides[f] = 1 - sides[f];
      }
    }
  }
  return cut_between_labels(topology, sides);
}

}  // namespace atelier
