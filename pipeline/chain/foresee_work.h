#pragma once

#include <cstddef>
#include <functional>
#include <string_view>

#include "pipeline/chain/chain.h"

namespace atelier {

/// As `plan_stage` on the stages of the program, with the caller's events.
using PlanOfStage = std::function<StagePlan(const Stage& stage, const StageRequest& request)>;

/// Finds the work to do for every stage that is to run (Chain::foreseen). Errors in data are told
/// by the stage when its turn comes, of a dry run now. Throws StopRequested if `plan` does, and as
/// `require_startable`.
void foresee_work(Chain& chain, const PlanOfStage& plan);

/// Whether a stage of this run is foreseen to take its time.
bool is_foreseen_to_work(const Chain& chain, std::string_view stage);

/// How many times longer than expected stages take: those that have ended, and the one that is at
/// work, of which it is known that it takes so many seconds in all.
/// @param seconds  0: not known
double chain_pace(const Chain& chain, std::size_t now, double seconds);

/// s that remain behind the stage at work.
/// @param seconds  that it takes in all; 0: not known
double seconds_after(const Chain& chain, std::size_t i, double seconds);

/// Expected seconds of the report on the results that are there at the end; 0 if this run writes
/// none. Stages that take longer than expected say nothing of it.
double expected_report_seconds(const Chain& chain);

}  // namespace atelier
