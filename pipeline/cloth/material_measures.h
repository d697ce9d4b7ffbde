#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// material.*: the largest relative error ("error") of fitted stiffnesses against those that a
/// synthetic capture's garments have, and material.<label>.stretch_error, bending_error. Nothing of
/// a material that was not fitted.
std::vector<Measure> measure_material(const std::filesystem::path& workspace,
                                      const std::filesystem::path& capture);

}  // namespace atelier
