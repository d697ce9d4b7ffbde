#include "registration/orient_faces.h"

#include <utility>
#include <vector>

#include "core/topology.h"

namespace atelier {

Triangles consistently_oriented(const Triangles& faces, Index vertex_count) {
  const Topology topology = topology_of(faces, vertex_count);
  Triangles oriented = faces;
  std::vector<int> turned(static_cast<std::size_t>(faces.rows()), -1);
  for (Index seed = 0; seed < faces.rows(); ++seed) {
    if (turned[static_cast<std::size_t>(seed)] >= 0) {
      continue;
    }
    std::vector<int> piece{static_cast<int>(seed)};
    turned[static_cast<std::size_t>(seed)] = 0;
    Index turns = 0;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      const int face = piece[i];
      for (int k = 0; k < 3; ++k) {
        const int edge = topology.face_edges(face, k);
        if (edge < 0 || corners_of_edge(topology, edge).size() != 2) {
          continue;
        }
        const auto sharing = corners_of_edge(topology, edge);
        const int other = sharing[0] / 3 == face ? sharing[1] : sharing[0];
        int& known = turned[static_cast<std::size_t>(other / 3)];
        if (known < 0) {
          // Neighbours agree if they run along their edge in opposite directions.
          const bool same = faces(face, k) == faces(other / 3, other % 3);
          known = turned[static_cast<std::size_t>(face)] ^ (same ? 1 : 0);
          turns += known;
          piece.push_back(other / 3);
        }
      }
    }
    const int wrong = 2 * turns > static_cast<Index>(piece.size()) ? 0 : 1;
    for (const int face : piece) {
      if (turned[static_cast<std::size_t>(face)] == wrong) {
        std::swap(oriented(face, 1), oriented(face, 2));
      }
    }
  }
  return oriented;
}

}  // namespace atelier
