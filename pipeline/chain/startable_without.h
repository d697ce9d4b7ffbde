#pragma once

#include <span>
#include <string>

#include "core/store/stage_plan.h"

namespace atelier {

/// Refuses a stage that reads a capture as its INPUT and could not begin if the current results of
/// some stages were gone: it opens the capture, as the stage's options say, asks for results that
/// the stage reads and that would be missing, and what `require_startable` asks. Quick beside the
/// stage. Throws DataError, EnvironmentError, UsageError of corrections that the capture does not
/// take.
/// @param aside  names of stages
void require_startable_without(const Stage& stage, const StageRequest& request,
                               std::span<const std::string> aside);

}  // namespace atelier
