#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// Constraints between options of `material`.
const OptionRules& material_rules();

/// Constraints between options of cloth, its solvers and `simulate`.
const OptionRules& cloth_rules();

}  // namespace atelier
