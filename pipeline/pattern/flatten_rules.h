#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// Constraints between options of `flatten`: it seeks seams where none are given, and relaxes on a
/// body to hang on.
const OptionRules& flatten_rules();

}  // namespace atelier
