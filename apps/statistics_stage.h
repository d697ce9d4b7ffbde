#pragma once

#include <string>

#include "core/mesh_statistics.h"
#include "core/store/stage.h"

namespace atelier {

struct StatisticsStageOptions {
  MeshStatisticsOptions statistics;
  std::string unit = "m";  ///< of files that do not say
  std::string up = "y";    ///< of files that do not say
};

OptionTable describe(StatisticsStageOptions& options);

/// A mesh sequence -> frames/<frame>.json (one mesh each) and statistics.json (all of them, and
/// their ranges).
void run_statistics(StageRun& run);

}  // namespace atelier
