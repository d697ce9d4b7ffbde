#pragma once

#include <string>
#include <vector>

#include "core/options.h"
#include "simulation/cloth/solver_options.h"

namespace atelier {

/// What each solver has of its own that changes how far cloth is solved, for commands that ask no
/// more of it: "xpbd.substeps", "xpbd.iterations" and "projective_friction.*".
/// @param without  names that are left out, with their section
OptionTable describe_sections(SolverOptions& options, const std::vector<std::string>& without = {});

/// Options with another's solver, substeps and sections of solvers: cloth and contact stay as they
/// are.
SolverOptions solved_as(SolverOptions options, const SolverOptions& other);

}  // namespace atelier
