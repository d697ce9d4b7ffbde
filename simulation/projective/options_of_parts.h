#pragma once

#include "simulation/xpbd/xpbd.h"

namespace atelier {

/// The options of projective dynamics as the parts that both solvers share take them.
inline XpbdOptions options_of_parts(const SolverOptions& options) {
  XpbdOptions shared;
  const CommonSolverOptions& common = options;
  static_cast<CommonSolverOptions&>(shared) = common;
  shared.substeps = options.projective.substeps;
  shared.precision = "double";
  return shared;
}

}  // namespace atelier
