#pragma once

#include "apps/command.h"
#include "core/store/stage.h"

namespace atelier {

/// The command of a stage: `atelier <stage> INPUT WORKSPACE --section.field value`.
Action add_stage(CLI::App& parser, const Stage& stage);

}  // namespace atelier
