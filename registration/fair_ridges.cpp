#include "registration/fair_ridges.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <utility>
#include <vector>

#include "core/error.h"
#include "registration/rim_vertices.h"

namespace atelier {
namespace {

constexpr int kFairRings = 2;         // around a sharp face, at first
constexpr int kFairRoundsOfRing = 4;  // until one more is taken

/// Vertices of faces that are sharper than `least` and not at the rim, and so many rings around.
std::vector<char> sharp_region(const Topology& topology, const Points& x, double least, int rings,
                               const Adjacency& neighbors, const std::vector<char>& rim) {
  const Eigen::VectorXd cosines = cosines_around(topology, x);
  std::vector<char> region(rim.size(), 0);
  for (Index f = 0; f < cosines.size(); ++f) {
    bool sharp = cosines[f] < least;
    for (const int v : topology.faces.row(f)) {
      sharp = sharp && rim[static_cast<std::size_t>(v)] == 0;
    }
    for (const int v : topology.faces.row(f)) {
      region[static_cast<std::size_t>(v)] |= sharp ? 1 : 0;
    }
  }
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<char> inner = region;
    for (std::size_t v = 0; v < inner.size(); ++v) {
      for (const int other : neighbors[static_cast<Index>(v)]) {
        region[v] |= inner[static_cast<std::size_t>(other)];
      }
    }
  }
  for (std::size_t v = 0; v < region.size(); ++v) {
    region[v] = region[v] != 0 && rim[v] == 0 ? 1 : 0;
  }
  return region;
}

/// A vertex less the mean of its neighbours is as small as can be in and beside the region, whose
/// vertices are free. False where that says nothing.
bool fair(Points& x, const std::vector<char>& region, const Adjacency& neighbors,
          const std::vector<char>& rim, double share) {
  std::vector<int> unknown(region.size(), -1);
  std::vector<int> vertices;
  for (std::size_t v = 0; v < region.size(); ++v) {
    if (region[v] != 0) {
      unknown[v] = static_cast<int>(vertices.size());
      vertices.push_back(static_cast<int>(v));
    }
  }
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<Eigen::RowVector3d> right;
  for (std::size_t v = 0; v < region.size(); ++v) {
    const auto& around = neighbors[static_cast<Index>(v)];
    bool counts = region[v] != 0;
    for (const int other : around) {
      counts = counts || region[static_cast<std::size_t>(other)] != 0;
    }
    if (!counts || rim[v] != 0 || around.empty()) {
      continue;
    }
    const int row = static_cast<int>(right.size());
    right.emplace_back(Eigen::RowVector3d::Zero());
    const auto add = [&](int vertex, double weight) {
      const int column = unknown[static_cast<std::size_t>(vertex)];
      if (column >= 0) {
        entries.emplace_back(row, column, weight);
      } else {
        right.back() -= weight * x.row(vertex);
      }
    };
    add(static_cast<int>(v), 1);
    for (const int other : around) {
      add(other, -1.0 / static_cast<double>(around.size()));
    }
  }
  Eigen::SparseMatrix<double> rows(std::ssize(right), std::ssize(vertices));
  rows.setFromTriplets(entries.begin(), entries.end());
  Eigen::MatrixX3d values(std::ssize(right), 3);
  for (std::size_t i = 0; i < right.size(); ++i) {
    values.row(static_cast<Index>(i)) = right[i];
  }
  const Eigen::SparseMatrix<double> system = rows.transpose() * rows;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
  if (solver.info() != Eigen::Success) {
    return false;
  }
  const Eigen::MatrixX3d fairest = solver.solve(rows.transpose() * values);
  if (!fairest.allFinite()) {
    return false;
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    x.row(vertices[i]) += share * (fairest.row(static_cast<Index>(i)) - x.row(vertices[i]));
  }
  return true;
}

}  // namespace

Eigen::VectorXd cosines_around(const Topology& topology, const Points& x) {
  const Triangles& faces = topology.faces;
  Points area_normals(faces.rows(), 3);
  Points sums = Points::Zero(x.rows(), 3);
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = x.row(faces(f, 0)).transpose();
    const Eigen::Vector3d b = x.row(faces(f, 1)).transpose();
    const Eigen::Vector3d c = x.row(faces(f, 2)).transpose();
    area_normals.row(f) = (b - a).cross(c - a).transpose();
    for (int k = 0; k < 3; ++k) {
      sums.row(faces(f, k)) += area_normals.row(f);
    }
  }
  Eigen::VectorXd cosines(faces.rows());
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3d around = sums.row(faces(f, 0)) + sums.row(faces(f, 1)) +
                                      sums.row(faces(f, 2)) - 3 * area_normals.row(f);
    const double lengths = around.norm() * area_normals.row(f).norm();
    cosines[f] = lengths > 0 ? around.dot(area_normals.row(f)) / lengths : 0;
  }
  return cosines;
}

Points faired_ridges(const Topology& topology, Points x, const FairRidgesOptions& options) {
  constexpr double kShare = 0.5;  // of the way: where one round is enough, less of the fold is lost
  ATELIER_CHECK(options.least >= -1 && options.least <= 1 && options.rounds >= 0,
                "a cosine, and no negative number of rounds");
  ATELIER_CHECK(topology.vertex_count == x.rows() && x.allFinite(), "vertices of another surface");
  const Adjacency neighbors = vertex_neighbors(topology);
  const std::vector<char> rim = rim_vertices(topology);
  for (int round = 0; round < options.rounds; ++round) {
    const std::vector<char> region = sharp_region(
        topology, x, options.least, kFairRings + round / kFairRoundsOfRing, neighbors, rim);
    if (std::find(region.begin(), region.end(), 1) == region.end() ||
        !fair(x, region, neighbors, rim, kShare)) {
      break;
    }
  }
  return x;
}

}  // namespace atelier
