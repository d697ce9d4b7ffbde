#include "registration/tracking/cut_rim_folds.h"

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "core/normals.h"
#include "core/topology.h"
#include "registration/rim_vertices.h"
#include "registration/tracking/register_garment.h"

namespace atelier {
namespace {

/// A triangle at the rim that is to go, or -1.
Index fold_at_rim(const Points& x, const Topology& topology) {
  constexpr double kThin = 0.05;
  const Triangles neighbors = face_neighbors(topology);
  const std::vector<char> rim = rim_vertices(topology);
  std::vector<char> turned(static_cast<std::size_t>(topology.faces.rows()), 0);
  // Crumpled triangles next to those at the rim are cut free from there.
  std::vector<char> crumpled(static_cast<std::size_t>(x.rows()), 0);
  for (const int f : inverted_faces(topology, x)) {
    turned[static_cast<std::size_t>(f)] = 1;
    if ((neighbors.row(f).array() >= 0).all()) {
      for (const int v : topology.faces.row(f)) {
        crumpled[static_cast<std::size_t>(v)] = 1;
      }
    }
  }
  for (Index f = 0; f < topology.faces.rows(); ++f) {
    for (const int v : topology.faces.row(f)) {
      turned[static_cast<std::size_t>(f)] |= crumpled[static_cast<std::size_t>(v)];
    }
  }
  // Of a flap of several triangles none is turned against those around it.
  constexpr double kFolded = -0.5;  // cosine of 120 degrees
  const Points normals = face_normals(x, topology.faces);
  for (Index f = 0; f < topology.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int other = neighbors(f, k);
      if (other >= 0 && normals.row(f).dot(normals.row(other)) < kFolded) {
        turned[static_cast<std::size_t>(f)] = 1;
      }
    }
  }
  for (Index f = 0; f < topology.faces.rows(); ++f) {
    std::array<int, 2> edges = {-1, -1};  // open, the other
    int open = 0;
    for (int k = 0; k < 3; ++k) {
      const bool ends = neighbors(f, k) < 0;
      open += ends ? 1 : 0;
      edges[ends ? 0 : 1] = k;
    }
    if (open == 2) {
      const int k = edges[1];
      const Eigen::RowVector3d from = x.row(topology.faces(f, k));
      const Eigen::RowVector3d base = x.row(topology.faces(f, (k + 1) % 3)) - from;
      const Eigen::RowVector3d side = x.row(topology.faces(f, (k + 2) % 3)) - from;
      if (turned[static_cast<std::size_t>(f)] != 0 ||
          base.cross(side).norm() < kThin * base.squaredNorm()) {
        return f;
      }
    } else if (open == 1 && turned[static_cast<std::size_t>(f)] != 0 &&
               rim[static_cast<std::size_t>(topology.faces(f, (edges[0] + 2) % 3))] == 0) {
      return f;
    }
  }
  return -1;
}

}  // namespace

Mesh cut_rim_folds(Mesh mesh) {
  for (;;) {
    const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
    const Index fold = fold_at_rim(mesh.vertices, topology);
    if (fold < 0) {
      return mesh;
    }
    std::vector<int> to(static_cast<std::size_t>(mesh.vertices.rows()), -1);
    Mesh rest;
    rest.faces.resize(mesh.faces.rows() - 1, 3);
    for (Index f = 0; f < rest.faces.rows(); ++f) {
      rest.faces.row(f) = mesh.faces.row(f < fold ? f : f + 1);
      for (int k = 0; k < 3; ++k) {
        to[static_cast<std::size_t>(rest.faces(f, k))] = 0;
      }
    }
    std::vector<Index> kept;
    for (std::size_t v = 0; v < to.size(); ++v) {
      if (to[v] == 0) {
        to[v] = static_cast<int>(kept.size());
        kept.push_back(static_cast<Index>(v));
      }
    }
    rest.faces =
        rest.faces.unaryExpr([&](int v) { return to[static_cast<std::size_t>(v)]; }).eval();
    rest.vertices = mesh.vertices(kept, Eigen::all);
    mesh = std::move(rest);
  }
}

}  // namespace atelier
