#pragma once

#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_REGISTRATION) && \
    defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_BODYMODEL) && \
    defined(ATELIER_HAS_CORE_RENDER)

#include <array>
#include <filesystem>
#include <map>
#include <string>

#include "apps/said_material.h"
#include "core/garment.h"
#include "core/store/stage.h"
#include "simulation/stiffness_search.h"

namespace atelier {

struct MaterialStageOptions {
  /// "fitted", or a fabric, whose values are then taken as they are.
  Material material = fabrics_own_material("fitted");
  StiffnessSearchOptions search = {.fine = 0, .band = 0.2, .usual = {}};
  bool usual = true;           ///< published fabrics decide what the capture leaves open
  double leash = 20;           ///< 1/s, how quickly cloth is led back to where it was seen, 1 to 60
  std::string sequence = "";   ///< of the capture; "": the first clothed one
  int frames = 12;             ///< of it that are simulated, 2 to 10000
  double edge_length = 0.035;  ///< m of the garments as they are tried, 0.005 to 0.2
  int substeps = 20;           ///< of a sixtieth of a second, 1 to 1000
  bool self_contact = false;   ///< cloth against cloth in a trial
};
OptionTable describe(MaterialStageOptions& options);

inline constexpr std::array kMaterialMetrics = {
    StageMetric{"garments", ""},        StageMetric{"fitted", ""},
    StageMetric{"trials", ""},          StageMetric{"frames", ""},
    StageMetric{"distance", "m"},       StageMetric{"stretch", "N/m"},
    StageMetric{"bending", "N m"},      StageMetric{"stretch_low", "N/m"},
    StageMetric{"stretch_high", "N/m"}, StageMetric{"bending_low", "N m"},
    StageMetric{"bending_high", "N m"}, StageMetric{"seconds_a_trial", "s"},
};

/// Registered garments, bodies and the tracked motion -> material.json: of each garment its
/// material, how near its simulation comes to where it was registered, the range of each stiffness
/// that does as well, the likely range, every trial; grid.png: the garments at the end of the
/// coarse grid's scenes.
void run_material(StageRun& run);

/// A garment's material as it was found or given.
struct FoundMaterial {
  Material material;
  Stiffness likely_low;   ///< nine in ten are between this and
  Stiffness likely_high;  ///< this; both 0 where it was given
};

/// Materials of the garments, by their names, from the stage's result. Throws DataError for a file
/// that is damaged.
std::map<std::string, FoundMaterial> read_materials(const std::filesystem::path& result);

}  // namespace atelier

#endif
