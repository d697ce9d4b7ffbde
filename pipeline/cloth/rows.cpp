#include "capture/layouts/open_dataset.h"
#include "pipeline/cloth/material_stage.h"
#include "pipeline/cloth/simulate_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {

const StageRow& material_row() {
  static const StageRow row{
      .stage = {.name = "material",
                .version = 4,
                .summary = "stiffness of each garment's cloth, estimated from its motion",
                .inputs = {"capture", "person", "tracked", "bodies", "template", "registered"},
                .outputs = {"fitted_material"},
                .metrics = kMaterialMetrics,
                .options = option_set<MaterialStageOptions>,
                .run = run_material,
                .check_input = require_no_folder_above},
  };
  return row;
}

const StageRow& simulate_row() {
  static const StageRow row{
      .stage = {.name = "simulate",
                .version = 8,
                .summary = "simulation of garments on a body at rest or in motion",
                .inputs = {"scene"},
                .outputs = {"states", "garment"},
                .metrics = kSimulateMetrics,
                .options = option_set<SimulateOptions>,
                .run = run_simulate,
                .check_input = check_simulate_input,
                .frame_wise = true,
                .has_cuda = true,
                .device_keyed = true},
  };
  return row;
}

}  // namespace atelier
