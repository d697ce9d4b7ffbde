#pragma once

#include <vector>

namespace atelier {

/// Unknowns of a material fit; the rest of a material is given.
struct Stiffness {
  double stretch = 0;  ///< N/m
  double bending = 0;  ///< N m
};

/// One simulation.
struct StiffnessTrial {
  Stiffness stiffness;
  double distance = 0;  ///< m from what was seen; infinite where the simulation broke
};

/// Values that do about as well as the best.
struct StiffnessRange {
  double low = 0;
  double high = 0;
  bool open_low = false;   ///< the least value that was tried is one of them
  bool open_high = false;  ///< and so is the largest
};

/// Values of the trials whose distance is within a share of the least; open at an end where the
/// least or the largest value that was tried is among them. Zeros for no trial.
StiffnessRange range_within(const std::vector<StiffnessTrial>& trials, double share,
                            double Stiffness::*axis);

/// The one of least distance. There must be one.
const StiffnessTrial& nearest_trial(const std::vector<StiffnessTrial>& trials);

}  // namespace atelier
