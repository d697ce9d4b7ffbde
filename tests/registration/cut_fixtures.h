#pragma once

#include <vector>

#include "core/mesh.h"
#include "core/topology.h"
#include "registration/edge_paths.h"
#include "registration/flattening/cut_to_disks.h"

namespace atelier::fixtures {

inline std::vector<char> no_cut(const Topology& topology) {
  return std::vector<char>(static_cast<std::size_t>(topology.edges.rows()), 0);
}

inline Topology topology(const Mesh& mesh) {
  return topology_of(mesh.faces, mesh.vertices.rows());
}

inline std::vector<char> opened(const Mesh& mesh) {
  const Topology whole = topology(mesh);
  return cut_to_disks(whole, no_cut(whole), edge_lengths(whole, mesh.vertices));
}

}  // namespace atelier::fixtures
