#pragma once

#include <span>
#include <string_view>

#include "core/store/stage.h"
#include "core/store/stage_plan.h"

namespace atelier {

/// Everything that the program knows of a stage: what the runner needs, and what the loops over all
/// stages (the chain of `run`, evaluation, option rules, the report) ask of each. A room of pipeline/
/// has a function `const StageRow& <stage>_row()` for each of its stages, and names them in its line
/// of CMakeLists.txt; nothing else lists stages.
struct StageRow {
  Stage stage;

  /// The stage that it is listed behind, if not the one before it in its room: one whose results are
  /// handed over as its INPUT.
  std::string_view after = "";

  /// Refuses at once, in the stage's own words, what it would refuse once it has its inputs: files,
  /// cameras and frames that options name and that are not there. Quick, and not all that it may
  /// find wrong. Null: nothing. Throws DataError, EnvironmentError.
  void (*require_startable)(const StageRequest& request) = nullptr;
};

/// Every row that the program was linked with, in the order of CMakeLists.txt. The source of this
/// function is generated (atelier_stage_table in cmake/Targets.cmake).
std::span<const StageRow* const> linked_stage_rows();

}  // namespace atelier
