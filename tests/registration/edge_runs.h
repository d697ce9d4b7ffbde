#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/garment.h"
#include "core/topology.h"
#include "registration/flattening/flat_pattern.h"

namespace atelier::fixtures {

/// A run of a panel's outline: one side of a seam, or what of an opening is the panel's.
struct EdgeRun {
  double was = 0;  ///< m, in the pattern that the garment was made of
  double is = 0;   ///< m, as it is laid flat
};

/// Every run of the outlines of a garment's panels, by panel and what it is.
/// @param seams  vertices of `garment.rest`
/// @param flat   of the garment's mesh, cut along its seams
inline std::map<std::string, EdgeRun> edge_runs(const Garment& garment,
                                                const std::vector<Seam>& seams,
                                                const FlatPattern& flat) {
  std::map<std::pair<int, int>, std::string> sewn;  // edges of the rest shape
  for (std::size_t s = 0; s < seams.size(); ++s) {
    for (const auto& [side, run] : {std::pair{"a", &seams[s].a}, std::pair{"b", &seams[s].b}}) {
      for (std::size_t i = 1; i < run->size(); ++i) {
        sewn[std::minmax((*run)[i - 1], (*run)[i])] = "seam " + std::to_string(s) + side;
      }
    }
  }
  // Of an unsewn garment a loop has one of two vertices that are sewn together: an edge there is
  // told by its other end.
  std::map<int, std::string> opening_of;  // vertices of the mesh
  for (std::size_t b = 0; b < garment.boundaries.size(); ++b) {
    for (const int v : garment.boundaries[b]) {
      opening_of[v] = garment.boundary_names[b];
    }
  }
  std::map<std::string, EdgeRun> runs;
  const Topology cut = topology_of(flat.cut.faces, static_cast<Index>(flat.cut.source.size()));
  for (Index e = 0; e < cut.edges.rows(); ++e) {
    if (corners_of_edge(cut, e).size() != 1) {
      continue;
    }
    const int face = corners_of_edge(cut, e).front() / 3;
    const int k = corners_of_edge(cut, e).front() % 3;
    const int next = (k + 1) % 3;
    const int a = garment.rest_faces(face, k);
    const int b = garment.rest_faces(face, next);
    const auto side = sewn.find(std::minmax(a, b));
    const auto here = opening_of.find(garment.mesh.faces(face, k));
    const auto there = opening_of.find(garment.mesh.faces(face, next));
    EdgeRun& run = runs[garment.panel_names[static_cast<std::size_t>(
                            garment.panels[static_cast<std::size_t>(face)])] +
                        ", " +
                        (side != sewn.end()          ? side->second
                         : here != opening_of.end()  ? here->second
                         : there != opening_of.end() ? there->second
                                                     : std::string("of nothing"))];
    run.was += (garment.rest.row(a) - garment.rest.row(b)).norm();
    run.is += (flat.vertices.row(cut.edges(e, 0)) - flat.vertices.row(cut.edges(e, 1))).norm();
  }
  return runs;
}

}  // namespace atelier::fixtures
