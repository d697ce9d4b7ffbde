#pragma once

#include "pipeline/row/option_rules.h"

namespace atelier {

/// What options of a capture, its corrections among them, and of its surfaces keep to.
const OptionRules& capture_rules();

}  // namespace atelier
