#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// Constraints between options of `personalize` and `track`.
const OptionRules& person_rules();

/// Constraints between options of `body` and `refine`.
const OptionRules& body_rules();

}  // namespace atelier
