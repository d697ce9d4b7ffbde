#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/store/stage_plan.h"
#include "core/store/workspace_status.h"

namespace atelier {

/// The command that recomputes a stage's result, from the first stage behind it that is outdated or
/// whose result is not there (set aside by `run --replace`).
/// @param own      one of `all`, outdated
/// @param capture  that the workspace is of
std::string mending_command(const std::vector<StageStatus>& all, const StageStatus& own,
                            const std::filesystem::path& workspace,
                            const std::filesystem::path& capture);

/// A sentence on each of some stages whose current result is outdated, as `workspace_status` judges
/// it: why, and the command that recomputes it. None of stages without a result.
/// @param names  of stages
std::vector<std::string> outdated_results(const std::filesystem::path& workspace,
                                          const std::vector<std::string_view>& names);

/// The same of the results that a stage is about to read, as inputs and behind its INPUT, and one
/// on each of those behind its INPUT that another result has replaced: what is made of them is
/// outdated as soon as it is there.
std::vector<std::string> outdated_inputs(const Stage& stage, const StageRequest& request);

}  // namespace atelier
