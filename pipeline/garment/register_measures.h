#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// register.*: how far registered garments are from a synthetic capture's ground truth, over what
/// two cameras see, of all garments and (register.<label>.*) of each: "chamfer_mm",
/// "point_mean_mm", "point_p95_mm" (each template vertex is bound to the nearest true material
/// point in the template's frame), "inverted" (triangles turned against their neighbours),
/// "drift_mm" (median error along the surface in the last frame), "inside_rate" (share of vertices
/// and triangles' centres inside the estimated body, not judged). Without targets where the
/// capture's cloth is plain.
std::vector<Measure> measure_register(const std::filesystem::path& workspace,
                                      const std::filesystem::path& capture);

/// The frame in whose pose the template of a garment is, out of a result of `register`.
int registered_template_frame(const std::filesystem::path& registered, const std::string& name);

}  // namespace atelier
