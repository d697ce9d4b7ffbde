#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/finding.h"
#include "core/measure.h"
#include "core/store/stage.h"
#include "core/store/stage_plan.h"
#include "pipeline/row/chain_place.h"
#include "pipeline/row/key_figure.h"
#include "pipeline/row/option_rules.h"
#include "pipeline/row/report_places.h"
#include "pipeline/row/target.h"

namespace atelier {

/// The description of a stage: the part that the runner needs, and hooks for the loops over all
/// stages (the chain of `run`, evaluation, targets, option rules, the report). A room (a folder of
/// pipeline/) has a function `const StageRow& <stage>_row()` for each of its stages, and names the
/// stages in its line of CMakeLists.txt; nothing else lists stages.
struct StageRow {
  Stage stage;
  /// Description of its command's INPUT for --help, a noun phrase.
  std::string_view input_help = "File or folder to read";

  /// The stage that it is listed after, if not the previous one of its room: the one that makes its
  /// INPUT.
  std::string_view after = "";

  /// Checks before a run, with the stage's own error messages, that files, cameras and frames named
  /// by options exist. Quick; the stage may find other errors later. Null: no check. Throws
  /// DataError, EnvironmentError.
  void (*require_startable)(const StageRequest& request) = nullptr;

  /// Reads what options name as a run would, where that takes seconds and not minutes, for a dry
  /// run and before hours of other stages: what the run would say of it, without doing it. A
  /// request without a workspace is one whose results are recomputed before. Null: nothing. Throws
  /// what the run would.
  std::vector<Finding> (*preview)(const StageRequest& request) = nullptr;

  /// Its place in the chain of `run`; none: `run` leaves it out.
  std::optional<ChainPlace> chain = {};

  /// Measures of its result in a workspace against a synthetic capture's ground truth; empty where
  /// there is no result. Throws DataError. Null: it has no measures.
  std::vector<Measure> (*measure)(const std::filesystem::path& workspace,
                                  const std::filesystem::path& truth) = nullptr;
  /// Why its result cannot be measured, though it is not outdated; "" if it can. Null: it can.
  std::string (*problem)(const std::filesystem::path& workspace,
                         const std::filesystem::path& truth) = nullptr;
  /// A stage to compare with: evaluating that stage alone also evaluates this one.
  std::string_view measured_for = "";
  /// A measure derived from those of several stages, given all measures. Null: none.
  std::optional<Measure> (*comparison)(const std::filesystem::path& workspace,
                                       std::span<const Measure> measures) = nullptr;
  /// Order of its measures among those of other stages; equal ones follow the order of rooms.
  int measure_place = 0;

  std::span<const Target> targets = {};

  /// Metrics by which a result is judged where there is no ground truth.
  std::span<const KeyFigure> key_figures = {};

  /// Constraints between its options. Several rows may share one set. Null: none.
  const OptionRules* rules = nullptr;

  /// HTML with embedded images that the report shows for an undamaged result, beside its files; ""
  /// for nothing. Throws DataError where a result or the capture cannot be read. Null: nothing.
  std::string (*pictures)(const StageStatus& own, const ReportPlaces& places) = nullptr;
};

/// Every row that the program was linked with, in the order of CMakeLists.txt. The source of this
/// function is generated (atelier_stage_table in cmake/Targets.cmake).
std::span<const StageRow* const> linked_stage_rows();

}  // namespace atelier
