#include "registration/taut_surface.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/laplacian.h"
#include "core/topology.h"
#include "registration/edge_paths.h"

namespace atelier {
namespace {

constexpr std::size_t kLeastFrames = 5;
constexpr double kMostChange = 0.3;  // of a length: no fold takes more
constexpr double kStay = 1e-4;       // of a vertex's own place, so that it is somewhere

/// The length that each edge has in the frames in which it is long.
Eigen::VectorXd long_lengths(const Topology& topology, const std::vector<Points>& frames,
                             double quantile) {
  const Index edges = topology.edges.rows();
  std::vector<std::vector<double>> of_frame;
  of_frame.reserve(frames.size());
  for (const Points& frame : frames) {
    of_frame.push_back(edge_lengths(topology, frame));
  }
  const auto rank =
      static_cast<std::ptrdiff_t>(std::lround(quantile * static_cast<double>(frames.size() - 1)));
  Eigen::VectorXd lengths(edges);
  std::vector<double> own(frames.size());
  for (Index e = 0; e < edges; ++e) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      own[i] = of_frame[i][static_cast<std::size_t>(e)];
    }
    std::nth_element(own.begin(), own.begin() + rank, own.end());
    lengths[e] = own[static_cast<std::size_t>(rank)];
  }
  return lengths;
}

/// What is to lie around each vertex over what does, averaged over `reach`.
Eigen::VectorXd growth(const Mesh& mesh, const Topology& topology, const Eigen::VectorXd& wanted,
                       const Eigen::VectorXd& own, double reach) {
  Eigen::MatrixX2d around = Eigen::MatrixX2d::Zero(mesh.vertices.rows(), 2);
  for (Index e = 0; e < own.size(); ++e) {
    for (int k = 0; k < 2; ++k) {
      around.row(topology.edges(e, k)) += Eigen::RowVector2d(wanted[e], own[e]);
    }
  }
  Eigen::SparseMatrix<double> system =
      reach * reach * cotangent_laplacian(mesh.vertices, mesh.faces, {.skip_degenerate = true});
  const Eigen::VectorXd areas = voronoi_areas(mesh.vertices, mesh.faces).cwiseMax(1e-12);
  for (Index v = 0; v < areas.size(); ++v) {
    system.coeffRef(v, v) += areas[v];
  }
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
  const Eigen::MatrixX2d even = solver.solve(areas.asDiagonal() * around);
  Eigen::VectorXd ratios = Eigen::VectorXd::Ones(areas.size());
  for (Index v = 0; v < ratios.size(); ++v) {
    if (even(v, 1) > 0) {
      ratios[v] = std::clamp(even(v, 0) / even(v, 1), 1 - kMostChange, 1 + kMostChange);
    }
  }
  return ratios;
}

/// Each vertex less the mean of its neighbours, [V,V].
Eigen::SparseMatrix<double> graph_laplacian(const Topology& topology, Index vertices) {
  Eigen::VectorXd degree = Eigen::VectorXd::Zero(vertices);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    degree[topology.edges(e, 0)] += 1;
    degree[topology.edges(e, 1)] += 1;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    for (int k = 0; k < 2; ++k) {
      const int v = topology.edges(e, k);
      entries.emplace_back(v, topology.edges(e, 1 - k), -1 / degree[v]);
    }
  }
  for (Index v = 0; v < vertices; ++v) {
    entries.emplace_back(v, v, degree[v] > 0 ? 1 : 0);
  }
  Eigen::SparseMatrix<double> laplacian(vertices, vertices);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  return laplacian;
}

}  // namespace

Points taut_surface(const Mesh& mesh, const std::vector<Points>& frames,
                    const TautOptions& options) {
  const Index count = mesh.vertices.rows();
  ATELIER_CHECK(options.quantile >= 0 && options.quantile <= 1, "a quantile in [0, 1]");
  ATELIER_CHECK(options.reach > 0, "a reach of more than zero");
  ATELIER_CHECK(mesh.vertices.allFinite(), "coordinates must be finite");
  for (const Points& frame : frames) {
    ATELIER_CHECK(frame.rows() == count && frame.allFinite(),
                  "finite vertices of the mesh in each frame");
  }
  if (frames.size() < kLeastFrames || mesh.faces.rows() == 0) {
    return mesh.vertices;
  }
  const Topology topology = topology_of(mesh.faces, count);
  const std::vector<double> given = edge_lengths(topology, mesh.vertices);
  const Eigen::VectorXd own =
      Eigen::Map<const Eigen::VectorXd>(given.data(), static_cast<Index>(given.size()));
  const Eigen::VectorXd ratios =
      growth(mesh, topology, long_lengths(topology, frames, options.quantile), own, options.reach);

  const Eigen::SparseMatrix<double> laplacian = graph_laplacian(topology, count);
  Eigen::SparseMatrix<double> together = laplacian.transpose() * laplacian;
  for (Index v = 0; v < count; ++v) {
    together.coeffRef(v, v) += kStay;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (Index e = 0; e < own.size(); ++e) {
    const int a = topology.edges(e, 0);
    const int b = topology.edges(e, 1);
    entries.emplace_back(a, a, 1);
    entries.emplace_back(b, b, 1);
    entries.emplace_back(a, b, -1);
    entries.emplace_back(b, a, -1);
  }
  Eigen::SparseMatrix<double> edges(count, count);
  edges.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(
      Eigen::SparseMatrix<double>(edges + together));
  if (solver.info() != Eigen::Success) {
    return mesh.vertices;
  }
  const Eigen::MatrixX3d stay = together * mesh.vertices;
  Points points = mesh.vertices;
  constexpr int kRounds = 25;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixX3d right = stay;
    for (Index e = 0; e < own.size(); ++e) {
      const int a = topology.edges(e, 0);
      const int b = topology.edges(e, 1);
      const Eigen::RowVector3d way = points.row(a) - points.row(b);
      const double length = way.norm();
      if (length > 0) {
        const Eigen::RowVector3d wanted = own[e] * (ratios[a] + ratios[b]) / 2 / length * way;
        right.row(a) += wanted;
        right.row(b) -= wanted;
      }
    }
    points = solver.solve(right);
  }
  return points;
}

}  // namespace atelier
