#include <algorithm>
#include <cmath>

#include "core/io/text_scanner.h"
#include "core/io/usd_mesh.h"
#include "core/io/usd_text.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(usda) {
  const std::string_view text = atelier::as_text(bytes);
  const atelier::UsdLayer layer = atelier::parse_usda(text, "usda");
  const double unit = layer.metres_per_unit.value_or(1);
  ATELIER_CHECK(std::isfinite(unit) && unit > 0, "a scene of no size");
  atelier::Limits limits;
  limits.tensor_bytes = 64 << 20;
  const atelier::UsdStage stage = atelier::read_usda_stage(text, "usda", limits);
  if (std::none_of(stage.prims.begin(), stage.prims.end(),
                   [](const atelier::UsdPrim& prim) { return prim.type == "Mesh"; })) {
    return;
  }
  const atelier::UsdMesh usd = atelier::usd_mesh(stage, "usda", limits);
  atelier::check_mesh(usd.mesh, "usda");
  for (const atelier::Points& frame : usd.frames) {
    ATELIER_CHECK(frame.rows() == usd.mesh.vertices.rows() && frame.allFinite(),
                  "frames of the mesh's vertices");
  }
}
