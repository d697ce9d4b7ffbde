#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "bodymodel/underlying/clothed_scan.h"
#include "core/normals.h"
#include "core/random.h"
#include "core/topology.h"
#include "tests/support/shapes.h"

namespace atelier::fixtures {

/// A ball of the size of a trunk: body, clothes and scans with known answers.
inline Mesh ball(double radius, int levels = 4) {
  Mesh mesh = sphere(levels);
  mesh.vertices *= radius;
  return mesh;
}

/// Scan of a body that wears cloth at a height `gap` above it where `is_worn`, and is skin
/// elsewhere.
inline ClothedScan worn_on(const Mesh& body,
                           const std::function<bool(const Eigen::RowVector3d&)>& is_worn,
                           double gap) {
  ClothedScan scan{body, {}};
  const Points normals = vertex_normals(body.vertices, body.faces);
  for (Index v = 0; v < body.vertices.rows(); ++v) {
    const bool worn = is_worn(body.vertices.row(v));
    scan.roles.push_back(worn ? ScanRole::Cloth : ScanRole::Skin);
    if (worn) {
      scan.mesh.vertices.row(v) += gap * normals.row(v);
    }
  }
  return scan;
}

/// The part of a scan whose faces lie where `is_kept`.
inline ClothedScan part_of(const ClothedScan& scan,
                           const std::function<bool(const Eigen::RowVector3d&)>& is_kept) {
  ClothedScan part;
  std::vector<int> to(static_cast<std::size_t>(scan.mesh.vertices.rows()), -1);
  std::vector<int> from;
  std::vector<int> faces;
  for (Index f = 0; f < scan.mesh.faces.rows(); ++f) {
    if (!is_kept(scan.mesh.vertices.row(scan.mesh.faces(f, 0)))) {
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      const int v = scan.mesh.faces(f, k);
      int& index = to[static_cast<std::size_t>(v)];
      if (index < 0) {
        index = static_cast<int>(from.size());
        from.push_back(v);
        if (!scan.roles.empty()) {
          part.roles.push_back(scan.roles[static_cast<std::size_t>(v)]);
        }
      }
      faces.push_back(index);
    }
  }
  part.mesh.vertices = scan.mesh.vertices(from, Eigen::all);
  part.mesh.faces =
      Eigen::Map<const Triangles>(faces.data(), static_cast<Index>(faces.size()) / 3, 3);
  return part;
}

/// Smooth random displacement of a surface, `rms` metres.
inline Points smooth_noise(const Mesh& mesh, double rms, std::uint64_t seed, int rounds = 40) {
  Random random{seed};
  Points noise(mesh.vertices.rows(), 3);
  for (Index i = 0; i < noise.size(); ++i) {
    noise.data()[i] = normal(random);
  }
  const Adjacency neighbors = vertex_neighbors(topology_of(mesh.faces, mesh.vertices.rows()));
  for (int round = 0; round < rounds; ++round) {
    Points next = noise;
    for (Index v = 0; v < noise.rows(); ++v) {
      for (const int n : neighbors[v]) {
        next.row(v) += noise.row(n);
      }
      next.row(v) /= static_cast<double>(neighbors[v].size() + 1);
    }
    noise = std::move(next);
  }
  return noise * (rms / std::sqrt(noise.rowwise().squaredNorm().mean()));
}

}  // namespace atelier::fixtures
