#pragma once

#include <span>
#include <vector>

#include "core/camera.h"

namespace atelier {

/// A lens' radial factor written in another form: least squares over the radii of its image
/// (our choice: 64 radii at Chebyshev nodes, so that the largest error is near the least possible).
struct RadialFit {
  std::vector<double> coefficients;
  double error = 0;  ///< largest error of r times the factor, in focal lengths
};

/// The factor (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3) of OpenCV's
/// rational lens that stands for the polynomial 1 + r2 (k1 + r2 (k2 + ...)) up to the distorted
/// radius `reach` (tangent of the angle, in focal lengths), or to where the polynomial folds back.
/// @return  k1 k2 k3 k4 k5 k6
RadialFit rational_of_polynomial(std::span<const double> polynomial, double reach);

/// The reverse, of a camera with a rational lens (Distortion::Brown), up to the corners of its
/// image: `count` coefficients k1, k2, ...
RadialFit polynomial_of_rational(const Camera& camera, int count);

/// Largest distance of an image's corner from the principal point, in focal lengths; of a camera
/// without a size that of an image in whose middle the principal point is.
double corner_reach(const Camera& camera);

}  // namespace atelier
