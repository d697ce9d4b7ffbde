#pragma once

#include <Eigen/Core>
#include <vector>

#include "capture/surface/color_gains.h"

namespace atelier {

/// Gains of cameras, and how sure they are.
struct MeasuredGains {
  Eigen::MatrixX3d gain;       ///< [C,3] of each camera and channel
  Eigen::MatrixX3d deviation;  ///< [C,3] standard deviation, relative
};

/// Gains again, from what gloss cannot change. White gloss adds the same to all channels of a
/// sample, more for some cameras than for others wherever they stand to the lights, and on skin and
/// smooth cloth passes for up to 5% of gain. Differences between channels are free of it (after
/// Mallick 2005): per place the part of sample / gain that is orthogonal to white must agree
/// between cameras. Gauss-Newton, iterated reweighting (Cauchy), places eliminated. The gains found
/// so far hold, to 2%, what colours alone do not tell: a scene of one colour leaves a direction
/// open, and a grey scene all. Our choice.
/// @param places  [of each place its samples], cameras numbered as the rows of `first`
/// @param first  found so far
/// @return with geometric mean 1 in each channel; `first` where fewer than 100 samples have colour
MeasuredGains gloss_free_gains(const std::vector<std::vector<ColorSample>>& places,
                               const MeasuredGains& first);

}  // namespace atelier
