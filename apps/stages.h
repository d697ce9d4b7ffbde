#pragma once

#include <span>
#include <string_view>

#include "core/store/stage.h"

namespace atelier {

/// Every stage that exists, in the order of the pipeline.
std::span<const Stage> all_stages();

struct StandAlone;

/// What the stage of that name also does without a workspace, or null.
const StandAlone* stand_alone(std::string_view stage);

}  // namespace atelier
