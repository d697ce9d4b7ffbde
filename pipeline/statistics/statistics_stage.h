#pragma once

#include <array>
#include <filesystem>

#include "core/io/polygon_mesh.h"
#include "core/mesh_statistics.h"
#include "core/store/stage.h"

namespace atelier {

struct StatisticsStageOptions {
  MeshStatisticsOptions statistics;
  MeshConvention input{.metres_per_unit = 1, .up = 'y'};  ///< of files that do not say
};

OptionTable describe(StatisticsStageOptions& options);

inline constexpr std::array kStatisticsMetrics = {
    StageMetric{"frames", ""},
    StageMetric{"vertices_mean", ""},
    StageMetric{"faces_mean", ""},
    StageMetric{"area_mean", "m2"},
    StageMetric{"boundary_loops_mean", ""},
    StageMetric{"non_manifold_edges_mean", ""},
    StageMetric{"inconsistent_edges_mean", ""},
};

/// Throws DataError for a folder that is no mesh sequence.
void check_statistics_input(const std::filesystem::path& input, const OptionTable& options);

/// A mesh sequence -> frames/<frame>.json (one mesh each) and statistics.json (all of them, and
/// their ranges).
void run_statistics(StageRun& run);

}  // namespace atelier
