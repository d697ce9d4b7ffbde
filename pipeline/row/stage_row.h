#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/measure.h"
#include "core/store/stage.h"
#include "core/store/stage_plan.h"
#include "pipeline/row/chain_place.h"
#include "pipeline/row/option_rules.h"
#include "pipeline/row/report_places.h"
#include "pipeline/row/target.h"

namespace atelier {

/// Everything that the program knows of a stage: what the runner needs, and what the loops over all
/// stages (the chain of `run`, evaluation, targets, option rules, the report) ask of each. A room
/// of pipeline/ has a function `const StageRow& <stage>_row()` for each of its stages, and names
/// them in its line of CMakeLists.txt; nothing else lists stages.
struct StageRow {
  Stage stage;

  /// The stage that it is listed behind, if not the one before it in its room: one whose results
  /// are handed over as its INPUT.
  std::string_view after = "";

  /// Refuses at once, in the stage's own words, what it would refuse once it has its inputs: files,
  /// cameras and frames that options name and that are not there. Quick, and not all that it may
  /// find wrong. Null: nothing. Throws DataError, EnvironmentError.
  void (*require_startable)(const StageRequest& request) = nullptr;

  /// How `run` comes by it; none: `run` leaves it out.
  std::optional<ChainPlace> chain = {};

  /// Figures of its result in a workspace against a synthetic capture's ground truth; none where
  /// there is no result. Throws DataError. Null: it has no figures.
  std::vector<Measure> (*measure)(const std::filesystem::path& workspace,
                                  const std::filesystem::path& truth) = nullptr;
  /// Why its result cannot be measured, though it is not outdated; "" if it can. Null: it can.
  std::string (*problem)(const std::filesystem::path& workspace,
                         const std::filesystem::path& truth) = nullptr;
  /// A stage whose figures are compared with this one's: who asks for those gets these as well.
  std::string_view measured_for = "";
  /// A figure that follows from those of several stages, given all of them. Null: none.
  std::optional<Measure> (*comparison)(const std::filesystem::path& workspace,
                                       std::span<const Measure> measures) = nullptr;
  /// Place of its figures among those of other stages; of equal ones, as the rooms are listed.
  int measure_place = 0;

  std::span<const Target> targets = {};

  /// What its options have to keep to together. Several rows may share one set. Null: nothing.
  const OptionRules* rules = nullptr;

  /// What the report shows of its sound result beside its files, as HTML with images inside; "" for
  /// nothing. Throws DataError where a result or the capture cannot be read. Null: nothing.
  std::string (*pictures)(const StageStatus& own, const ReportPlaces& places) = nullptr;
};

/// Every row that the program was linked with, in the order of CMakeLists.txt. The source of this
/// function is generated (atelier_stage_table in cmake/Targets.cmake).
std::span<const StageRow* const> linked_stage_rows();

}  // namespace atelier
