#pragma once

#include <array>

#include "core/store/stage.h"
#include "pipeline/cloth/material_trials.h"

namespace atelier {

inline constexpr std::array kMaterialMetrics = {
    StageMetric{"garments", ""},        StageMetric{"fitted", ""},
    StageMetric{"trials", ""},          StageMetric{"frames", ""},
    StageMetric{"distance", "m"},       StageMetric{"stretch", "N/m"},
    StageMetric{"bending", "N m"},      StageMetric{"stretch_low", "N/m"},
    StageMetric{"stretch_high", "N/m"}, StageMetric{"bending_low", "N m"},
    StageMetric{"bending_high", "N m"}, StageMetric{"seconds_a_trial", "s"},
};

/// Registered garments, bodies and the tracked motion -> material.json
/// (simulation/files/material_file.h); grid.png: the garments at the end of the coarse grid's
/// scenes, beside the capture's own picture of that frame (material_grid.h).
void run_material(StageRun& run);

}  // namespace atelier
