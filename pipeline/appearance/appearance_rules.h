#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// Constraints between options of a network.
const OptionRules& appearance_rules();

}  // namespace atelier
