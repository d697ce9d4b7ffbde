#pragma once

#include <string>
#include <vector>

#include "simulation/cloth/frame_report.h"
#include "simulation/cloth/solver_options.h"

namespace atelier {

/// How the options are named that help.
struct HelpfulOptions {
  SolverOptions solver{};    ///< whose; the solver's name alone is read
  std::string section = "";  ///< that all of them begin with: "cloth"
  std::string thickness = solver_flag("thickness");
};

/// Aspects of a finished simulation that are doubtful, a sentence each with the worst frame and
/// what helps: cloth stretched beyond any fabric (its steps have not converged), edges of cloth and
/// body that pierce one another, vertices inside the body, cloth through itself. `self_contact`:
/// whether cloth knew of itself. The thresholds are our choice: strain p95 of 15% or of one edge
/// 100%, 1 mm inside.
std::vector<std::string> simulation_diagnostics(const std::vector<FrameReport>& reports,
                                                bool self_contact,
                                                const HelpfulOptions& named = {});

}  // namespace atelier
