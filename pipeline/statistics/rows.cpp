#include "pipeline/row/stage_row.h"
#include "pipeline/statistics/statistics_stage.h"

namespace atelier {

const StageRow& statistics_row() {
  static const StageRow row{
      .stage = {.name = "statistics",
                .version = 3,
                .summary =
                    "statistics of a mesh sequence: counts, area, volume, bounds, edges, holes",
                .inputs = {"meshes"},
                .outputs = {"statistics"},
                .metrics = kStatisticsMetrics,
                .options = option_set<StatisticsStageOptions>,
                .run = run_statistics,
                .check_input = check_statistics_input,
                .frame_wise = true},
      .input_help =
          "Mesh sequence: a folder of meshes, one a frame, or sequence.h5 with its frames",
  };
  return row;
}

}  // namespace atelier
