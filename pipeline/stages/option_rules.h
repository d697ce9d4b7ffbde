#pragma once

#include <string>
#include <vector>

#include "core/options.h"

namespace atelier {

/// Violated constraints between options, by the rules of every stage that takes them
/// (StageRow::rules), a sentence for each, with their names: "search.stretch_low cannot be 1000
/// with search.stretch_high 100: it takes less than that"; what was said, by flag or file, and does
/// nothing beside the others: "xpbd.jacobi_radius does nothing with xpbd.sweep gauss-seidel: leave
/// it out, or say --xpbd.sweep jacobi"; what another asks for and was not said: "exclude region
/// takes --region: ...". The functions behind would take the first for a defect of the program.
/// @param table  of a stage, of a command that takes options of stages, or of a run; every value is
///               in its own range
std::vector<std::string> broken_rules(const OptionTable& table);

}  // namespace atelier
