#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// What options of `material` keep to.
const OptionRules& material_rules();

/// What options of cloth, its solvers and `simulate` keep to.
const OptionRules& cloth_rules();

}  // namespace atelier
