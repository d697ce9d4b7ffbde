#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// animate.*: how far garments simulated in the capture's own motion are from its true ones, of
/// all and (animate.<label>.*) of each: "point_mean_mm", "point_p95_mm" (each vertex is bound to
/// the nearest true material point in its template's frame). Nothing of other motions and garments.
std::vector<Measure> measure_animate(const std::filesystem::path& workspace,
                                     const std::filesystem::path& capture);

}  // namespace atelier
