#pragma once

#include <Eigen/Core>

#include "core/image.h"
#include "core/options.h"
#include "core/random.h"

namespace atelier {

/// Noise of a camera's sensor.
struct SensorOptions {
  double exposure = 1;  ///< factor on the light before the camera's own gain, above 0 to 100
  double shot_noise =
      0.005;  ///< standard deviation at a linear value of 1; grows as its root; 0..1
  double read_noise = 0.0005;  ///< standard deviation in the dark, linear, 0..1
};
OptionTable describe(SensorOptions& options);

/// The light that falls on the sensor: exposure times gain times `image`, still linear.
Image exposed(const Image& image, const Eigen::Vector3d& gain, const SensorOptions& options = {});

/// Linear light with the sensor's noise. The noise of a pixel depends on seed, stream and its place
/// alone, so that images may be made in any order on any number of threads.
Image noisy(const Image& image, const SensorOptions& options, std::uint64_t seed,
            std::uint64_t stream);

}  // namespace atelier
