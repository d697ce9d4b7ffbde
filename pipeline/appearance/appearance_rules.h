#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// What options of a network keep to.
const OptionRules& appearance_rules();

}  // namespace atelier
