#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>

#include "apps/simulation_scene.h"
#include "core/store/stage.h"

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
};

/// The stage: INPUT is a folder with a garment, a body and a motion (scene_in). One file a frame
/// holds the cloth's state and report (simulation_table.h), so that a run that was ended goes on
/// with the same bits; then the garment as a sequence, frames.csv with a line of figures a frame,
/// and sheet.png with pictures along the way. Metrics are the worst of all frames.
void run_simulate(StageRun& run);

/// Throws DataError unless it is the folder of a scene.
void check_simulate_input(const std::filesystem::path& input);

/// The command alone: --garment, --body, --motion, --out (a folder, or a file T.h5 or T.usda),
/// --format, --grid. Every frame is in the folder (T.h5.frames) as soon as it is done; frames.csv
/// and pictures come at the end, each also where another of them or a frame cannot be written, and
/// what is thrown then says where the frames are. SIGINT and SIGTERM end it after the frame that it
/// is in, with frames.csv and sheet.png of what there is; then the signal ends the program.
int simulate_alone(const std::map<std::string, std::string>& values, const OptionSet& options,
                   Device device, bool json);

}  // namespace atelier
