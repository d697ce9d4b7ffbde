#pragma once

#include "bodymodel/tracking/solve_window.h"

namespace atelier {

struct ShapeSolution {
  Eigen::VectorXd shape;           ///< [S]
  std::vector<Eigen::VectorXd> x;  ///< [F]
  bool converged = false;
};

/// Shape values that frames share and the pose of each, together: least squares by Ceres (one
/// thread; shape eliminated last) over the frames' energies and a pull of every value to neutral
/// with half its plausible range as spread; `held` [S,S], if not empty, adds d^T held d of the
/// values d beyond neutral, for what values may not do together. Starts at `person`'s shape, which
/// has been through `with_shape`. Throws LogicError on sizes that do not agree.
ShapeSolution solve_shape(const FittedPerson& person,
                          const std::vector<const FrameTargets*>& frames,
                          const std::vector<Eigen::VectorXd>& start, const FrameWeights& weights,
                          int iterations, const Eigen::MatrixXd& held = {});

}  // namespace atelier
