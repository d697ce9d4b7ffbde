#pragma once

#include <functional>
#include <vector>

#include "core/options.h"
#include "simulation/material/fabric.h"
#include "simulation/material/stiffness_trials.h"

namespace atelier {

struct StiffnessSearchOptions {
  double stretch_low = 100;    ///< N/m, above 0
  double stretch_high = 1e4;   ///< N/m
  double bending_low = 1e-6;   ///< N m, above 0
  double bending_high = 1e-3;  ///< N m
  int coarse = 4;              ///< values of each over the whole range, 2 to 32
  int fine = 3;                ///< values of each around the best of those, 0 to 31
  double likelihood_width =
      0.1;  ///< share of the least distance within which a trial is as good, 0 to 10
  /// Decides where the distances do not; the default says nothing.
  StiffnessPrior prior;
};
OptionTable describe(StiffnessSearchOptions& options);

/// The stiffness of one garment.
struct StiffnessFit {
  Stiffness best;       ///< by the distances alone
  double distance = 0;  ///< m, of the nearest trial
  StiffnessRange stretch;
  StiffnessRange bending;
  Stiffness expected;       ///< by the distances and what is usual: the mean of the logarithms
  Stiffness credible_low;   ///< nine in ten are between this,
  Stiffness credible_high;  ///< and this, for each of the two by itself
  std::vector<StiffnessTrial> trials;  ///< the coarse grid, bending by bending, then the fine one
};

/// Distances, m, of every garment [G] in every scene [N]. In scene n garment g has the stiffness
/// scenes[n][g]. Not finite where a scene broke.
using StiffnessObjective = std::function<std::vector<std::vector<double>>(
    const std::vector<std::vector<Stiffness>>& scenes)>;

/// Looks for the stiffness of garments that are simulated together and come nearest to what was
/// seen (our choice): a grid over both stiffnesses, evenly in their logarithms, then a finer one
/// around each garment's best, half a step apart with the default, then the lowest point of the
/// paraboloid through the squared distances of the trials round the best. The first scenes give
/// every garment the same stiffness, the later ones each its own. Both lists of scenes are asked
/// for at once, so that they can run side by side. The ranges are those of trials within `band` of
/// the best: what the data cannot tell apart.
///
/// The expectation weighs every stiffness in the range (Bayes) by exp(-((d / least - 1) / band)^2 /
/// 2) of its distance d, straight between trials, and by how usual it is. So what the data leave
/// open is taken as fabrics are, and never the edge of what was tried. `band` stands for all that
/// the distances are off by, of which scatter tells little: judge it by whether known stiffnesses
/// lie in the likely range as often as it says (docs/results/material.md).
///
/// Throws LogicError for options out of range or an objective of another shape, DataError where
/// every scene of a garment broke.
std::vector<StiffnessFit> search_stiffness(int garments, const StiffnessObjective& objective,
                                           const StiffnessSearchOptions& options = {});

}  // namespace atelier
