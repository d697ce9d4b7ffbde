#include "registration/flattening/unstretched_surface.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/laplacian.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/topology.h"
#include "registration/rim_vertices.h"

namespace atelier {
namespace {

constexpr int kUnstretchRounds = 30;
constexpr double kAimedStretch = 0.3;   // of the bound: what lies outside draws
constexpr double kMoveTogether = 0.02;  // m: vertices move together over 2 pi times this

using FlatCorners =
    Eigen::Matrix<double, 3, 2>;  // of a face, or what x and y of the flat one become

/// Two sides of the flat face, as columns.
Eigen::Matrix2d flat_edges(const FlatPattern& pattern, Index face) {
  Eigen::Matrix2d edges;
  for (const int k : {1, 2}) {
    edges.col(k - 1) = (pattern.vertices.row(pattern.cut.faces(face, k)) -
                        pattern.vertices.row(pattern.cut.faces(face, 0)))
                           .transpose();
  }
  return edges;
}

/// By how much each panel is to be larger to have the area that the surface had in the beginning.
std::vector<double> panel_scales(const FlatPattern& pattern, const Eigen::VectorXd& face_area) {
  const auto panels = static_cast<std::size_t>(pattern.cut.panel_count);
  std::vector<double> surface(panels, 0), flat(panels, 0);
  for (Index f = 0; f < face_area.size(); ++f) {
    const auto panel = static_cast<std::size_t>(pattern.cut.panels[static_cast<std::size_t>(f)]);
    surface[panel] += face_area[f];
    flat[panel] += std::abs(flat_edges(pattern, f).determinant()) / 2;
  }
  std::vector<double> scales(panels, 1);
  for (std::size_t p = 0; p < panels; ++p) {
    if (surface[p] > 0 && flat[p] > 0) {
      scales[p] = std::sqrt(surface[p] / flat[p]);
    }
  }
  return scales;
}

/// How the flat face's x and y follow from its corners: each corner's share.
FlatCorners flat_gradients(const FlatPattern& pattern, Index face, double scale) {
  const Eigen::Matrix2d edges = scale * flat_edges(pattern, face);
  const Eigen::Matrix2d inverse = edges.inverse();
  FlatCorners shares;
  shares << -inverse.colwise().sum(), inverse;
  return shares;
}

/// The nearest deformation whose principal stretches are within 1 +- `bound`.
FlatCorners within_bound(const FlatCorners& deformation, double bound) {
  const Eigen::Matrix2d metric = deformation.transpose() * deformation;
  const double mean = metric.trace() / 2;
  const double off = std::hypot((metric(0, 0) - metric(1, 1)) / 2, metric(0, 1));
  const double large = std::sqrt(std::max(mean + off, 1e-12));
  const double small = std::sqrt(std::max(mean - off, 1e-12));
  const double angle = std::atan2(2 * metric(0, 1), metric(0, 0) - metric(1, 1)) / 2;
  const Eigen::Vector2d axis(std::cos(angle), std::sin(angle));
  const double to_large = std::clamp(large, 1 - bound, 1 + bound) / large;
  const double to_small = std::clamp(small, 1 - bound, 1 + bound) / small;
  return deformation *
         (to_small * Eigen::Matrix2d::Identity() + (to_large - to_small) * axis * axis.transpose());
}

/// Energy of the second derivatives of how vertices move; rims have none.
Eigen::SparseMatrix<double> moving_apart(const Mesh& mesh, const Eigen::VectorXd& areas) {
  const Eigen::SparseMatrix<double> laplacian =
      cotangent_laplacian(mesh.vertices, mesh.faces, {.skip_degenerate = true});
  Eigen::VectorXd inner = areas.cwiseInverse();
  const std::vector<char> rim = rim_vertices(topology_of(mesh.faces, mesh.vertices.rows()));
  for (Index v = 0; v < inner.size(); ++v) {
    inner[v] *= rim[static_cast<std::size_t>(v)] != 0 ? 0 : 1;
  }
  return (laplacian.transpose() * inner.asDiagonal() * laplacian).eval();
}

}  // namespace

Points unstretched_surface(const Mesh& mesh, const FlatPattern& pattern, double stretch,
                           double tolerance, const Points& start) {
  ATELIER_CHECK(stretch > 0 && tolerance > 0, "a stretch and a give of more than zero");
  ATELIER_CHECK(
      pattern.cut.faces.rows() == mesh.faces.rows() && start.rows() == mesh.vertices.rows(),
      "a pattern of the mesh's triangles, and a place for each vertex");
  const Index count = mesh.vertices.rows();
  const Eigen::VectorXd face_area = face_areas(mesh.vertices, mesh.faces);
  const Eigen::VectorXd areas = voronoi_areas(mesh.vertices, mesh.faces).cwiseMax(1e-12);
  // Cloth that gives way on and on would shrink: creases are ironed out, and the pattern follows.
  const std::vector<double> scales = panel_scales(pattern, face_area);
  std::vector<FlatCorners> gradients;
  std::vector<Eigen::Triplet<double>> entries;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto panel = static_cast<std::size_t>(pattern.cut.panels[static_cast<std::size_t>(f)]);
    gradients.push_back(flat_gradients(pattern, f, scales[panel]));
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        entries.emplace_back(mesh.faces(f, i), mesh.faces(f, j),
                             face_area[f] * gradients.back().row(i).dot(gradients.back().row(j)));
      }
    }
  }
  const double hold = std::pow(stretch / (tolerance / 2), 2);
  const Eigen::SparseMatrix<double> bending =
      std::pow(stretch * kMoveTogether * kMoveTogether / tolerance, 2) * moving_apart(mesh, areas);
  Eigen::SparseMatrix<double> system(count, count);
  system.setFromTriplets(entries.begin(), entries.end());
  system += bending;
  for (Index v = 0; v < count; ++v) {
    system.coeffRef(v, v) += hold * areas[v];
  }
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
  if (solver.info() != Eigen::Success) {
    return start;
  }
  const Eigen::MatrixX3d unbent = bending * mesh.vertices;
  std::vector<FlatCorners> targets(gradients.size());
  Points points = start;
  for (int round = 0; round < kUnstretchRounds; ++round) {
    parallel_for(mesh.faces.rows(), 1024, [&](Index begin, Index end) {
      for (Index f = begin; f < end; ++f) {
        FlatCorners deformation = FlatCorners::Zero();
        for (int k = 0; k < 3; ++k) {
          deformation += points.row(mesh.faces(f, k)).transpose() *
                         gradients[static_cast<std::size_t>(f)].row(k);
        }
        targets[static_cast<std::size_t>(f)] = within_bound(deformation, kAimedStretch * stretch);
      }
    });
    Eigen::MatrixX3d right = unbent;
    for (Index f = 0; f < mesh.faces.rows(); ++f) {
      const auto i = static_cast<std::size_t>(f);
      for (int k = 0; k < 3; ++k) {
        right.row(mesh.faces(f, k)) +=
            face_area[f] * (targets[i] * gradients[i].row(k).transpose()).transpose();
      }
    }
    for (Index v = 0; v < count; ++v) {
      const Eigen::RowVector3d way = points.row(v) - mesh.vertices.row(v);
      const double within = std::min(1.0, tolerance / std::max(way.norm(), 1e-12));
      right.row(v) += hold * areas[v] * (mesh.vertices.row(v) + within * way);
    }
    points = solver.solve(right);
  }
  return points;
}

}  // namespace atelier
