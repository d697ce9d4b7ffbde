#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// What options of `animate` keep to.
const OptionRules& animate_rules();

}  // namespace atelier
