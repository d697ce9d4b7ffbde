#include "core/io/mesh_ply.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(ply) {
  const atelier::PolygonMesh mesh = atelier::read_ply(bytes, "ply");
  atelier::check_mesh(atelier::triangulated(mesh), "ply");
  // What is read can be written and read again to the same mesh.
  const std::string file = atelier::ply_bytes(mesh, {.exact = true});
  const atelier::PolygonMesh again = atelier::read_ply(std::as_bytes(std::span(file)), "ply");
  ATELIER_CHECK(again.vertices == mesh.vertices && again.labels == mesh.labels &&
                    again.polygon_starts == mesh.polygon_starts &&
                    again.corner_vertices == mesh.corner_vertices,
                "PLY does not round-trip");
}
