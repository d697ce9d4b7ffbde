#pragma once

#include <string>
#include <vector>

#include "core/options.h"

namespace atelier {

/// What options break that they have to keep to together, a sentence for each, with their names:
/// "search.stretch_low cannot be 1000 with search.stretch_high 100: it takes less than that". Every
/// value is in its own range; the functions behind would take these for a defect of the program.
/// And what corrections of a capture have that no capture can take (correction_problem), behind the
/// file and line that they come from.
std::vector<std::string> broken_rules(const OptionTable& table);

}  // namespace atelier
