#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/store/stage.h"
#include "core/store/stage_plan.h"
#include "pipeline/row/stage_row.h"

namespace atelier {

/// Every stage that exists, in the order of the pipeline: each behind those whose results it reads,
/// also those that are handed over as its INPUT (`refine` behind `register`).
std::span<const Stage> all_stages();

/// Their rows, in the same order.
std::span<const StageRow* const> all_rows();

/// The row of that name, or null.
const StageRow* find_row(std::string_view stage);

/// Refuses at once, in the stage's own words, what it would refuse once it has its inputs: files
/// cameras and frames that options name and that are not there, a device that does not answer.
/// Quick, and not all that it may find wrong. Of a request without a workspace, whose results are
/// recomputed before, nothing that those say. Throws DataError, EnvironmentError.
void require_startable(const Stage& stage, const StageRequest& request);

/// Warnings that a run would begin with of what its options name, each as a line
/// (StageRow::preview). Throws what the run would.
std::vector<std::string> previewed_warnings(const Stage& stage, const StageRequest& request);

}  // namespace atelier
