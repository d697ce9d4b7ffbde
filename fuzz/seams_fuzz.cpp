#include <algorithm>
#include <string_view>

#include "fuzz/reader.h"
#include "registration/flattening/seam_input.h"

namespace {

/// Four triangles round the middle of a square.
atelier::Mesh square_of_four() {
  atelier::Mesh mesh;
  mesh.vertices.resize(5, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0.5, 0;
  mesh.faces.resize(4, 3);
  mesh.faces << 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4;
  return mesh;
}

}  // namespace

/// Seams of four triangles: one flag for each edge.
ATELIER_FUZZ_READER(seams) {
  static const atelier::Mesh mesh = square_of_four();
  static const atelier::Topology topology = atelier::topology_of(mesh.faces, mesh.vertices.rows());
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::vector<char> cut = atelier::parse_seams(text, mesh, topology, "seams");
  ATELIER_CHECK(static_cast<atelier::Index>(cut.size()) == topology.edges.rows() &&
                    std::all_of(cut.begin(), cut.end(), [](char c) { return c == 0 || c == 1; }),
                "a flag for each edge");
}
