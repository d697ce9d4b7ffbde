#pragma once

#include <filesystem>
#include <vector>

#include "capture/capture_measures.h"

namespace atelier {

/// material.*: the largest relative error ("error") of fitted stiffnesses against those that a
/// synthetic capture's garments have, and material.<label>.stretch_error, bending_error. Nothing of
/// a material that was not fitted.
std::vector<Measure> measure_material(const std::filesystem::path& workspace,
                                      const std::filesystem::path& capture);

/// animate.*: how far garments simulated in the capture's own motion are from its true ones, of
/// all and (animate.<label>.*) of each: "point_mean_mm", "point_p95_mm" (each vertex is bound to
/// the nearest true material point in its template's frame). Nothing of other motions and garments.
std::vector<Measure> measure_animate(const std::filesystem::path& workspace,
                                     const std::filesystem::path& capture);

}  // namespace atelier
