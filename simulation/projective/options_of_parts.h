#pragma once

#include "simulation/xpbd/xpbd.h"

namespace atelier {

/// The options of projective dynamics as the parts that both solvers share take them.
inline XpbdOptions options_of_parts(const SolverOptions& options) {
  XpbdOptions shared;
  static_cast<CommonSolverOptions&>(shared) = options;
  shared.substeps = options.projective.substeps;
  shared.precision = "double";
  return shared;
}

}  // namespace atelier
