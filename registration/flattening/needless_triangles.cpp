#include "registration/flattening/needless_triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "core/topology.h"
#include "registration/rim_vertices.h"

namespace atelier {
namespace {

Mesh without_leaving(const Mesh& mesh, const std::vector<char>& leaves) {
  std::vector<Index> kept;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    if (leaves[static_cast<std::size_t>(f)] == 0) {
      kept.push_back(f);
    }
  }
  Mesh result = mesh;
  result.faces = Triangles(mesh.faces(kept, Eigen::all));
  if (mesh.uv_faces.rows() == mesh.faces.rows()) {
    result.uv_faces = Triangles(mesh.uv_faces(kept, Eigen::all));
  }
  return result;
}

/// Those without area whose leaving parts nothing, none beside another.
std::vector<char> flat_ones_at_rim(const Mesh& mesh) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const std::vector<char> rim = rim_vertices(topology);
  std::vector<char> touched(rim.size(), 0);
  std::vector<char> leaves(static_cast<std::size_t>(mesh.faces.rows()), 0);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices.row(mesh.faces(f, k % 3)).transpose();
    };
    if (!is_without_area(corner(0), corner(1), corner(2))) {
      continue;
    }
    int open = 0;
    bool beside = false;    // of one that leaves
    bool may_join = false;  // in place of one open edge, the other two become the rim
    double longest = 0;
    for (int k = 0; k < 3; ++k) {
      longest = std::max(longest, (corner(k + 1) - corner(k)).norm());
      beside = beside || touched[static_cast<std::size_t>(mesh.faces(f, k))] != 0;
    }
    for (int k = 0; k < 3; ++k) {
      if (corners_of_edge(topology, topology.face_edges(f, k)).size() == 1) {
        ++open;
        may_join = rim[static_cast<std::size_t>(mesh.faces(f, (k + 2) % 3))] == 0 &&
                   (corner(k + 1) - corner(k)).norm() == longest;  // they lie on it
      }
    }
    if (beside || open == 0 || (open == 1 && !may_join)) {
      continue;
    }
    leaves[static_cast<std::size_t>(f)] = 1;
    for (int k = 0; k < 3; ++k) {
      touched[static_cast<std::size_t>(mesh.faces(f, k))] = 1;
    }
  }
  return leaves;
}

}  // namespace

bool is_without_area(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double longest =
      std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return !((b - a).cross(c - a).norm() > 1e-7 * longest);
}

Mesh without_needless_triangles(const Mesh& mesh) {
  const ManifoldDefects defects = manifold_defects(topology_of(mesh.faces, mesh.vertices.rows()));
  std::vector<char> leaves(static_cast<std::size_t>(mesh.faces.rows()), 0);
  for (const auto* faces : {&defects.degenerate_faces, &defects.duplicate_faces}) {
    for (const int f : *faces) {
      leaves[static_cast<std::size_t>(f)] = 1;
    }
  }
  Mesh rest = without_leaving(mesh, leaves);
  for (;;) {
    leaves = flat_ones_at_rim(rest);
    if (std::find(leaves.begin(), leaves.end(), 1) == leaves.end()) {
      return rest;
    }
    rest = without_leaving(rest, leaves);
  }
}

}  // namespace atelier
