#pragma once

#include "core/io/polygon_mesh.h"
#include "core/mesh_statistics.h"
#include "core/store/stage.h"

namespace atelier {

struct StatisticsStageOptions {
  MeshStatisticsOptions statistics;
  MeshConvention input{.metres_per_unit = 1, .up = 'y'};  ///< of files that do not say
};

OptionTable describe(StatisticsStageOptions& options);

/// A mesh sequence -> frames/<frame>.json (one mesh each) and statistics.json (all of them, and
/// their ranges).
void run_statistics(StageRun& run);

}  // namespace atelier
