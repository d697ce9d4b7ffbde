#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// Constraints between options of `animate`.
const OptionRules& animate_rules();

}  // namespace atelier
