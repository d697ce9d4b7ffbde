#pragma once

#include <array>
#include <filesystem>

#include "core/store/stage.h"
#include "pipeline/cloth/simulation_scene.h"

namespace atelier {

inline constexpr std::array kSimulateMetrics = {
    StageMetric{"frames", ""},
    StageMetric{"strain_p95", "of rest length"},
    StageMetric{"penetration_depth", "m"},
    StageMetric{"inside", "vertices"},
    StageMetric{"inside_depth", "m"},
    StageMetric{"body_crossings", ""},
    StageMetric{"body_gap", "of the thickness"},
    StageMetric{"crossings", ""},
    StageMetric{"self_gap", "of the thickness"},
    StageMetric{"strain_p999", "of rest length"},
    StageMetric{"captured_distance", "m"},
    StageMetric{"held_distance", "m"},
};

/// The stage: INPUT is a folder with a garment, a body and a motion (scene_in). One file a frame
/// holds the cloth's state and report (simulation_table.h), so that a run that was ended goes on
/// with the same bits; then the garment as a sequence, frames.csv with a line of figures a frame,
/// and sheet.png with images along the way. Metrics are the worst of all frames; captured_distance
/// is the mean distance of vertices from where they were captured, held_distance how far what holds
/// a garment is from where the body carries it.
void run_simulate(StageRun& run);

/// Throws DataError unless it is the folder of a scene.
void check_simulate_input(const std::filesystem::path& input, const OptionTable& options);

}  // namespace atelier
