#pragma once

#include <span>
#include <vector>

#include "core/finding.h"
#include "core/types.h"

namespace atelier {

/// Connectivity of a mesh: its edges and the triangles that share them. Combinatorial only:
/// positions play no part.
///
/// Corner k of a face is column k of `faces`; its edge k runs from corner k to corner (k + 1) % 3.
/// An edge with both ends the same vertex (of a degenerate face) is no edge: -1.
struct Topology {
  Index vertex_count = 0;
  Triangles faces;                ///< [F,3] as given
  Edges edges;                    ///< [E,2] smaller vertex first, in lexicographic order
  Triangles face_edges;           ///< [F,3] into edges, or -1
  std::vector<int> edge_offsets;  ///< [E+1] into edge_corners
  std::vector<int> edge_corners;  ///< corners 3 * face + k whose edge this is, increasing
};

/// Rows of different lengths, one behind the other.
struct Adjacency {
  std::vector<int> offsets;  ///< [N+1] into items
  std::vector<int> items;    ///< each row in increasing order

  std::span<const int> operator[](Index row) const {
    return {items.data() + offsets[row], items.data() + offsets[row + 1]};
  }
  Index rows() const { return static_cast<Index>(offsets.size()) - 1; }
};

/// Edges and their faces. Throws LogicError where a face names a vertex outside
/// [0, vertex_count). O(F log F).
Topology topology_of(const Triangles& faces, Index vertex_count);

/// Corners of one edge: one on the boundary, two inside a manifold surface, more where it branches.
inline std::span<const int> corners_of_edge(const Topology& topology, Index edge) {
  return {topology.edge_corners.data() + topology.edge_offsets[edge],
          topology.edge_corners.data() + topology.edge_offsets[edge + 1]};
}

/// Face on the other side of each edge of each face, [F,3]; -1 on the boundary and on edges that
/// branch.
Triangles face_neighbors(const Topology& topology);

/// Vertices that share an edge with each vertex.
Adjacency vertex_neighbors(const Topology& topology);

/// Faces around each vertex.
Adjacency vertex_faces(const Topology& topology);

/// Closed loops of boundary vertices, each in the direction of its faces' edges (the surface on the
/// left, seen from outside) and starting at its smallest vertex; loops in order of that vertex.
/// Where loops touch in a vertex they are parted there, so that no loop visits a vertex twice. Runs
/// that do not close (only where orientation is inconsistent) are left out.
std::vector<std::vector<int>> boundary_loops(const Topology& topology);

/// Pieces joined through shared vertices.
struct Components {
  int count = 0;
  std::vector<int> of_vertex;  ///< [V] component, numbered by smallest vertex
  std::vector<int> of_face;    ///< [F]
};

/// Connected components. A vertex without faces is a component of its own.
Components connected_components(const Topology& topology);

/// V - E + F over vertices that some face uses: 2 for a sphere, 1 for a disk, 0 for a torus or a
/// tube. Degenerate faces do not count.
int euler_characteristic(const Topology& topology);

/// Everything that keeps a triangle list from being an oriented manifold, each list increasing.
struct ManifoldDefects {
  std::vector<int> non_manifold_edges;     ///< edges with three or more faces
  std::vector<int> non_manifold_vertices;  ///< vertices whose faces are more than one fan
  std::vector<int> inconsistent_edges;     ///< edges that two faces run along in the same direction
  std::vector<int> duplicate_faces;        ///< same three vertices as an earlier face, in any order
  std::vector<int> degenerate_faces;       ///< a vertex more than once
  std::vector<int> isolated_vertices;      ///< no face; harmless, not counted by is_manifold
};

/// Looks for all of them.
ManifoldDefects manifold_defects(const Topology& topology);

/// True if no defect (isolated vertices aside) was found.
bool is_manifold(const ManifoldDefects& defects);

/// One finding per kind of defect, with its count and first places. Errors for what breaks
/// algorithms on surfaces, a warning for duplicates, a note for isolated vertices.
std::vector<Finding> findings_of(const ManifoldDefects& defects, const Topology& topology);

/// True if every edge has exactly two faces.
bool is_closed(const Topology& topology);

}  // namespace atelier
