#pragma once

#include <string>

#include "core/store/manifest.h"
#include "core/store/stage.h"

namespace atelier {

/// What a stage's result says against its input (StageMetric::input_errors above 0), as
/// "1 not_whole (garments)": the result is there, and what follows from it may be wrong. "" where
/// nothing is.
std::string input_errors_text(const Stage& stage, const Manifest& manifest);

}  // namespace atelier
