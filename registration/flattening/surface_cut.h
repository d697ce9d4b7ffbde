#pragma once

#include <vector>

#include "core/topology.h"
#include "core/types.h"

namespace atelier {

/// A surface cut open along edges: the same faces over more vertices, in panels.
struct SurfaceCut {
  Triangles faces;          ///< [F,3] into the cut vertices
  std::vector<int> source;  ///< [C] vertex of the whole surface that each cut vertex is
  std::vector<int> panels;  ///< [F] panel of each face, numbered by their smallest face
  int panel_count = 0;
};

/// Cuts along the edges with `cut[edge] != 0`; edges of one face or of more than two are cut
/// anyhow. A vertex becomes as many as there are fans of faces round it. A cut that ends inside a
/// panel is a dart. Throws LogicError unless there is one entry for each edge. O(F).
SurfaceCut cut_surface(const Topology& topology, const std::vector<char>& cut);

/// The edges between faces of different labels. `labels` is [F]; throws LogicError otherwise.
std::vector<char> cut_between_labels(const Topology& topology, const std::vector<int>& labels);

/// The edges named by their ends. Throws DataError for a pair that is no edge.
std::vector<char> cut_at_edges(const Topology& topology,
                               const std::vector<std::pair<int, int>>& ends);

}  // namespace atelier
