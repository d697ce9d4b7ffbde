#pragma once

#include <string>
#include <vector>

#include "core/options.h"

namespace atelier {

/// What options break that they have to keep to together, a sentence for each, with their names:
/// "search.stretch_low cannot be 1000 with search.stretch_high 100: it takes less than that";
/// what was said, by flag or file, and does nothing beside the others: "xpbd.jacobi_radius does
/// nothing with xpbd.sweep gauss-seidel: leave it out, or say --xpbd.sweep jacobi"; corrections of
/// cameras that are said to the person's stages, which read none; what another asks for and was not
/// said: "exclude region takes --region: ..."; and what corrections of a capture have that no
/// capture can take (correction_problem), or lists of labels that are none of what is worn
/// (excluded_problem), behind the file and line that they come from. Every value
/// is in its own range; the functions behind would take the first for a defect of the program.
std::vector<std::string> broken_rules(const OptionTable& table);

}  // namespace atelier
