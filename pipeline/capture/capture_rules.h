#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// Constraints between options of a capture, its corrections and its surfaces.
const OptionRules& capture_rules();

}  // namespace atelier
