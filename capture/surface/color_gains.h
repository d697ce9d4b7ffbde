#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/camera.h"
#include "core/finding.h"
#include "core/options.h"

namespace atelier {

/// The light of one place of a surface as one camera's image has it.
struct ColorSample {
  int camera = 0;
  int point = 0;                                    ///< place; any number, the same for all cameras
  Eigen::Vector3d color = Eigen::Vector3d::Zero();  ///< linear RGB
  double weight = 1;                                ///< above 0
};

struct ColorGainOptions {
  double darkest = 0.02;   ///< samples with a channel below are noise, [0, 1]
  double brightest = 0.9;  ///< samples with a channel above may be clipped, [0, 1]
  int min_points = 50;     ///< that a camera shares with others; fewer: its gain stays 1, 1 to 1e6
};
OptionTable describe(ColorGainOptions& options);

/// Gains that make the cameras of a rig agree.
struct ColorGains {
  std::vector<Eigen::Vector3d> gain;       ///< of each camera; geometric mean 1 in each channel
  std::vector<Eigen::Vector3d> deviation;  ///< standard deviation of each, relative
  std::vector<int> points;                 ///< places that each camera shares with others
  std::vector<bool> measured;              ///< false: too few places, its gain stays 1
  double spread = 0;  ///< relative deviation of one sample from its place's colour, robust
  std::vector<Finding> findings;  ///< "color-few-points", "color-unconnected"
};

/// Gains by which each camera multiplies the same light: log sample = log gain + log colour of the
/// place, least squares by iterated reweighting (Cauchy), places eliminated, each channel by
/// itself. Only ratios can be known: the geometric mean over the cameras that were found is 1 in
/// each channel. Highlights and wrong correspondences are outliers to it. Our choice throughout.
/// Throws LogicError for cameras out of range, DataError where no two cameras share
/// `min_points` places.
ColorGains color_gains(int cameras, const std::vector<ColorSample>& samples,
                       const ColorGainOptions& options = {});

/// How far gains are from the true ones, as shares.
struct GainError {
  double mean = 0;     ///< of the magnitudes, over cameras and channels
  double largest = 0;  ///< of them
};

/// Gains of cameras against those of a ground truth that has each of them by its id, channel by
/// channel, up to a factor on all cameras of a channel, which no images can tell. Throws DataError
/// for a camera that the ground truth does not have and for a gain that is not above 0.
GainError gain_error(const std::vector<Camera>& cameras, const std::vector<Camera>& truth);

}  // namespace atelier
