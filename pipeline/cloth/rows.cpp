#include <array>
#include <string>
#include <vector>

#include "capture/layouts/capture_lacks.h"
#include "capture/layouts/open_dataset.h"
#include "pipeline/cloth/captured_scene.h"
#include "pipeline/cloth/cloth_rules.h"
#include "pipeline/cloth/material_measures.h"
#include "pipeline/cloth/material_pictures.h"
#include "pipeline/cloth/material_stage.h"
#include "pipeline/cloth/simulate_measures.h"
#include "pipeline/cloth/simulate_pictures.h"
#include "pipeline/cloth/simulate_stage.h"
#include "pipeline/outfit/held_cloth.h"
#include "pipeline/row/stage_row.h"

namespace atelier {
namespace {

using enum Measure::Side;

constexpr std::array kMaterialTargets = {
    Target{"material.error", "largest relative error of a fitted stiffness", "", AtMost, 0.3, {}},
};

constexpr std::array kSimulateTargets = {
    Target{"simulate.held_mm",
           "largest distance of waistbands and necklines from where the body carries them", "mm",
           AtMost, 50, 100, "nothing holds the garments of the scene"},
    Target{"simulate.strain_p999",
           "edge strain of the simulated cloth, 99.9th percentile",
           "",
           AtMost,
           0.3,
           {},
           "the result is of an older version"},
};

constexpr const char* kFabric = "material.name";

std::string lacks_scene(const CaptureFacts& facts) {
  return facts.clothed_frames > 0 ? "" : "no garment was captured; animate puts a drafted one on";
}

std::vector<std::string_view> of_clothes(const CaptureFacts& /*facts*/) {
  return {"body", "register"};
}

std::filesystem::path simulated_scene(const RunPlaces& places) {
  return captured_scene(places.workspace);
}

constexpr std::array kMaterialFigures = {
    KeyFigure{"distance", "distance of the simulated cloth from the captured, rms",
              Measure::Side::AtMost, 0.02},
};

}  // namespace

const StageRow& material_row() {
  static const StageRow row{
      .stage = {.name = "material",
                .version = 5,
                .summary = "stiffness of each garment's cloth, estimated from its motion",
                .inputs = {"capture", "person", "tracked", "bodies", "template", "registered"},
                .outputs = {"fitted_material"},
                .metrics = kMaterialMetrics,
                .options = option_set<MaterialStageOptions>,
                .file_options = {"holding"},
                .run = run_material,
                .check_input = check_capture_input},
      .input_help = "Capture with clothed frames, of which WORKSPACE has the registered garments",
      .require_startable =
          [](const StageRequest& request) {
            require_holding_named(options_of<MaterialStageOptions>(request.options).holding);
          },
      .chain = ChainPlace{.lacks = lacks_clothes,
                          .cost = {.seconds = 1, .per_clothed = 0.7},
                          .report_cost = {.seconds = 0.5},
                          .fabric = kFabric},
      .measure = measure_material,
      .measure_place = 4,
      .targets = kMaterialTargets,
      .key_figures = kMaterialFigures,
      .rules = &material_rules(),
      .pictures = material_pictures,
  };
  return row;
}

const StageRow& simulate_row() {
  static const StageRow row{
      .stage = {.name = "simulate",
                .version = 9,
                .summary = "simulation of garments on a body at rest or in motion",
                .inputs = {"scene"},
                .outputs = {"states", "garment"},
                .metrics = kSimulateMetrics,
                .options = option_set<SimulateOptions>,
                .file_options = {"holding"},
                .run = run_simulate,
                .check_input = check_simulate_input,
                .frame_wise = true,
                .has_cuda = true,
                .device_keyed = true},
      .input_help =
          "Folder of a scene, such as WORKSPACE/scene: garment.*, body.* or body/, motion.*",
      .require_startable =
          [](const StageRequest& request) {
            require_holding_named(options_of<SimulateOptions>(request.options).holding);
          },
      .chain = ChainPlace{.lacks = lacks_scene,
                          .made_of = of_clothes,
                          .input = simulated_scene,
                          .cost = {.seconds = 6, .per_frame = 1},
                          .report_cost = {.seconds = 1},
                          .truth_cost = {.per_clothed = 0.3},
                          .fabric = kFabric},
      .measure = measure_simulate,
      .measure_place = 4,
      .targets = kSimulateTargets,
      .key_figures = kSimulateFigures,
      .rules = &cloth_rules(),
      .pictures = simulate_pictures,
  };
  return row;
}

}  // namespace atelier
