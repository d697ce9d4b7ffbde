#include "simulation/material/stiffness_trials.h"

#include <algorithm>
#include <limits>

namespace atelier {

const StiffnessTrial& nearest_trial(const std::vector<StiffnessTrial>& trials) {
  return *std::min_element(trials.begin(), trials.end(),
                           [](const StiffnessTrial& one, const StiffnessTrial& other) {
                             return one.distance < other.distance;
                           });
}

StiffnessRange range_within(const std::vector<StiffnessTrial>& trials, double share,
                            double Stiffness::*axis) {
  if (trials.empty()) {
    return {};
  }
  const double limit = (1 + share) * nearest_trial(trials).distance;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double least = kInfinity;
  double largest = 0;
  StiffnessRange range{kInfinity, 0, false, false};
  for (const StiffnessTrial& trial : trials) {
    const double value = trial.stiffness.*axis;
    least = std::min(least, value);
    largest = std::max(largest, value);
    if (trial.distance <= limit) {
      range.low = std::min(range.low, value);
      range.high = std::max(range.high, value);
    }
  }
  range.open_low = range.low <= least * (1 + 1e-9);
  range.open_high = range.high >= largest * (1 - 1e-9);
  return range;
}

}  // namespace atelier
