#pragma once

#include "capture/stereo/stereo_math.h"

namespace atelier {

/// The planar prior, for surfaces with too little texture for windows of a few pixels: what is sure
/// nearby predicts a plane (Xu and Tao 2020). They triangulate sure pixels, so that the noise of
/// three of them is the plane's; here a plane is fitted to all of them within the smallest
/// window that has enough. The inverse depths of a plane are affine in the pixel, so that the fit
/// is a regression on sums over cells. Shared by the CPU and CUDA twins.

/// Sums over sure pixels: x and y are of the pixel's ray with z = 1, q is the inverse depth.
struct PriorMoments {
  double count, x, y, q, xx, xy, yy, xq, yq, qq;
};

ATELIER_HOST_DEVICE inline void add_moments(PriorMoments& sum, const PriorMoments& more) {
  sum.count += more.count;
  sum.x += more.x;
  sum.y += more.y;
  sum.q += more.q;
  sum.xx += more.xx;
  sum.xy += more.xy;
  sum.yy += more.yy;
  sum.xq += more.xq;
  sum.yq += more.yq;
  sum.qq += more.qq;
}

/// Of the cell's pixels whose plane costs little.
ATELIER_HOST_DEVICE inline PriorMoments cell_moments(const StereoProblem& problem,
                                                     const StereoPlane* planes, const float* costs,
                                                     int column, int row) {
  constexpr float kSure = 0.3f;
  PriorMoments sum = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  for (int dy = 0; dy < kPriorCell; ++dy) {
    for (int dx = 0; dx < kPriorCell; ++dx) {
      const int x = column * kPriorCell + dx;
      const int y = row * kPriorCell + dy;
      if (x >= problem.width || y >= problem.height) {
        continue;
      }
      const int p = y * problem.width + x;
      if (!(problem.near_depth[p] > 0) || !(planes[p].depth > 0) || !(costs[p] < kSure)) {
        continue;
      }
      const Vec3f ray = pixel_ray(problem, x, y);
      const double u = ray.x;
      const double v = ray.y;
      const double q = 1 / static_cast<double>(planes[p].depth);
      add_moments(sum, {1, u, v, q, u * u, u * v, v * v, u * q, v * q, q * q});
    }
  }
  return sum;
}

/// Plane through the sure pixels around a cell, as (a, b, c) with 1/depth = (a, b, c) . ray; zero
/// where too few are sure, or they lie on no plane to a fraction of a pixel of disparity.
/// @param moments  of every cell
ATELIER_HOST_DEVICE inline Vec3f predicted_plane(const StereoProblem& problem,
                                                 const PriorMoments* moments, int column, int row) {
  constexpr double kEnough = 0.25;          // of the window's pixels
  constexpr double kLargestResidual = 0.4;  // px of disparity, root of the mean square
  const int columns = prior_cells(problem.width);
  const int rows = prior_cells(problem.height);
  for (int radius = 1; radius <= 4; radius *= 2) {
    PriorMoments sum = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    for (int r = row - radius; r <= row + radius; ++r) {
      for (int c = column - radius; c <= column + radius; ++c) {
        if (r >= 0 && r < rows && c >= 0 && c < columns) {
          add_moments(sum, moments[r * columns + c]);
        }
      }
    }
    const double side = (2 * radius + 1) * kPriorCell;
    if (sum.count < kEnough * side * side) {
      continue;
    }
    const double scale = 1 / sum.count;
    const double mx = sum.x * scale;
    const double my = sum.y * scale;
    const double mq = sum.q * scale;
    const double xx = sum.xx * scale - mx * mx;
    const double xy = sum.xy * scale - mx * my;
    const double yy = sum.yy * scale - my * my;
    const double xq = sum.xq * scale - mx * mq;
    const double yq = sum.yq * scale - my * mq;
    const double determinant = xx * yy - xy * xy;
    // Spread over a pixel each way at least: else they lie on a line and tell no slope.
    const double pixel = 1 / (static_cast<double>(problem.fx) * problem.fy);
    if (!(determinant > pixel * pixel)) {
      continue;
    }
    const double a = (xq * yy - yq * xy) / determinant;
    const double b = (yq * xx - xq * xy) / determinant;
    const double residual = sum.qq * scale - mq * mq - a * xq - b * yq;
    const double bound = kLargestResidual / problem.source[0].parallax;
    if (residual > bound * bound) {
      break;  // a fold or an edge; a larger window holds it too
    }
    return {static_cast<float>(a), static_cast<float>(b), static_cast<float>(mq - a * mx - b * my)};
  }
  return {0, 0, 0};
}

/// The prior's prediction for a pixel; depth 0: none.
ATELIER_HOST_DEVICE inline StereoPlane predicted_at(const StereoProblem& problem, Vec3f ray, int x,
                                                    int y) {
  StereoPlane plane = {0, {0, 0, -1}};
  if (problem.prior == nullptr) {
    return plane;
  }
  const Vec3f inverse = problem.prior[y / kPriorCell * prior_cells(problem.width) + x / kPriorCell];
  const float inverse_depth = dot(inverse, ray);
  if (inverse_depth > 0) {
    plane.depth = 1 / inverse_depth;
    plane.normal = (-1 / norm(inverse)) * inverse;
  }
  return plane;
}

/// How much of the prior counts for a window, 0 to 1: all of it where there is no texture beyond
/// shading and noise; in texture the window knows better, and folds would be ironed flat.
ATELIER_HOST_DEVICE inline float plainness(const ReferenceWindow& window) {
  constexpr float kTexture = 0.01f;  // of values in [0,1], one standard deviation
  return decay(-0.5f / (kTexture * kTexture) * window.variance);
}

/// Cost of a plane that is not the predicted one, 0 to prior_weight: bounded, so that what windows
/// say clearly they still say (the prior of Xu and Tao 2020, equation 5, as a robust term).
ATELIER_HOST_DEVICE inline float prior_doubt(const StereoProblem& problem,
                                             const StereoPlane& predicted,
                                             const StereoPlane& plane) {
  constexpr float kPixels = 0.5f;  // of disparity in the first source, and
  constexpr float kAngle = 0.35f;  // rad: one standard deviation each
  if (!(predicted.depth > 0) || !(plane.depth > 0)) {
    return 0;
  }
  const float shift =
      problem.source[0].parallax * (1 / plane.depth - 1 / predicted.depth) * (1 / kPixels);
  const float turn = 2 * (1 - dot(plane.normal, predicted.normal)) * (1 / (kAngle * kAngle));
  return problem.prior_weight * (1 - decay(-0.5f * (shift * shift + (turn > 0 ? turn : 0))));
}

}  // namespace atelier
