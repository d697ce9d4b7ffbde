#pragma once

#include <filesystem>
#include <string>

#include "apps/console/command.h"
#include "apps/console/stand_alone.h"
#include "core/store/stage.h"

namespace atelier {

/// Refuses an INPUT or WORKSPACE that no stage may be given: a workspace inside its input or full
/// of other things, a name that is no printable UTF-8. Throws UsageError.
void require_stage_places(const std::filesystem::path& input,
                          const std::filesystem::path& workspace);

/// Refuses a WORKSPACE that is no folder and cannot become one, before anything looks for results
/// in it. Throws UsageError; EnvironmentError for a link to nothing.
void require_folder_or_nothing(const std::filesystem::path& workspace);

/// Says what is wrong with the text of --jobs; "" if it is a number of them. CLI11's own range says
/// nothing of whole numbers.
std::string jobs_problem(const std::string& text);

/// The command of a stage: `atelier <stage> INPUT WORKSPACE --section.field value`, and what it
/// does alone, if anything.
Action add_stage(CLI::App& parser, const Stage& stage, const StandAlone* alone = nullptr);

}  // namespace atelier
