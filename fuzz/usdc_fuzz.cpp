#include "core/io/usd_mesh.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(usdc) {
  atelier::Limits limits;
  limits.tensor_bytes = 64 << 20;
  const atelier::UsdMesh usd =
      atelier::usd_mesh(atelier::read_usd_crate(bytes, "usdc", limits), "usdc", limits);
  atelier::check_mesh(usd.mesh, "usdc");
  ATELIER_CHECK(usd.frames.size() == usd.times.size(), "a frame for each time");
  for (const atelier::Points& frame : usd.frames) {
    ATELIER_CHECK(frame.rows() == usd.mesh.vertices.rows() && frame.allFinite(),
                  "frames of the mesh's vertices");
  }
}
