#include "core/io/mesh_stl.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(stl) {
  const atelier::PolygonMesh mesh = atelier::read_stl(bytes, "stl");
  atelier::check_polygons(mesh);
  atelier::check_mesh(atelier::triangulated(mesh), "stl");
}
