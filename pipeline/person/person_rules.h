#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// What options of `personalize` and `track` keep to.
const OptionRules& person_rules();

/// What options of `body` and `refine` keep to.
const OptionRules& body_rules();

}  // namespace atelier
