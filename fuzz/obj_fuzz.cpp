#include "core/io/mesh_obj.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(obj) {
  const atelier::PolygonMesh mesh = atelier::read_obj(bytes, "obj");
  atelier::check_mesh(atelier::triangulated(mesh), "obj");
  // What is read can be written and read again to the same mesh.
  const std::string text = atelier::obj_text(mesh);
  const atelier::PolygonMesh again = atelier::read_obj(std::as_bytes(std::span(text)), "obj");
  ATELIER_CHECK(again.vertices == mesh.vertices && again.uvs == mesh.uvs &&
                    again.corner_vertices == mesh.corner_vertices &&
                    again.corner_uvs == mesh.corner_uvs,
                "OBJ does not round-trip");
}
