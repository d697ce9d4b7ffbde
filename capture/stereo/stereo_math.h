#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/host_device.h"
#include "core/vec.h"

namespace atelier {

/// Cost of a plane at a pixel in PatchMatch stereo, shared by the CPU and CUDA twins
/// (stereo_propagation_math.h says how planes are found).
///
/// A pixel's hypothesis is a plane in its camera's frame (Bleyer 2011). It is judged by how well a
/// window around the pixel, carried over the plane into a source view, agrees with what that view
/// sees: bilaterally weighted normalised cross-correlation (Schoenberger 2016, section 4).

inline constexpr int kLargestSources = 8;
inline constexpr float kWorstCost = 2;  ///< of a view that cannot see the window

// A window of 6 x 6 pixels without its corners: four vectors of eight. Small and dense: skin has
// fine texture and little else, and a large window is flat where limbs are round (on a synthetic
// person before 16 cameras, 11 x 11 pixels with every second one left the skin 60% further off).
inline constexpr int kWindowSamples = 32;
inline constexpr int kWindowRadius = 3;  ///< no sample is farther

/// Offset of a sample of the window from its pixel: -2 to 3.
ATELIER_HOST_DEVICE constexpr int window_x(int sample) {
  const int i = sample < 4 ? sample + 1 : sample < 28 ? sample + 2 : sample + 3;
  return i % 6 - 2;
}
ATELIER_HOST_DEVICE constexpr int window_y(int sample) {
  const int i = sample < 4 ? sample + 1 : sample < 28 ? sample + 2 : sample + 3;
  return i / 6 - 2;
}

/// The plane hypothesis of a pixel.
struct StereoPlane {
  float depth;   ///< metres along the optical axis; 0: none
  Vec3f normal;  ///< unit, in the camera's frame, towards the camera
};

/// A view that the reference is compared with. Pixels are (x, y, 1).
struct StereoSource {
  float forth[9];  ///< source pixel ~ forth * pixel + forth_t / depth, row major
  float forth_t[3];
  float back[9];  ///< and from the source to the reference
  float back_t[3];
  const float* image;  ///< [height,width]
  const float* depth;  ///< [height,width] of the view's own map, 0: none; or null
  float parallax;      ///< px m: how far a change of 1/depth moves a pixel's image there, about
  int width;
  int height;
};

/// A reference view with its sources at one resolution. Pointers are to the memory of the device.
struct StereoProblem {
  float fx, fy, cx, cy;  ///< pixels, first pixel's centre at 0.5
  int width, height;
  const float* image;       ///< [height,width] in [0,1], gamma-coded: noise is then even
  const float* near_depth;  ///< [height,width] metres; 0: the pixel is not looked at
  const float* far_depth;
  StereoSource source[kLargestSources];
  int sources;
  float colour_sigma;      ///< of the bilateral weight
  float level_weight;      ///< cost of brightness that differs by the window's contrast
  float geometric_weight;  ///< cost of a pixel of reprojection error
  const Vec3f* prior;      ///< [cells] predicted planes (predicted_plane), or null
  float prior_weight;      ///< cost of a plane that is far from the predicted one
  std::uint64_t seed;
};

/// Predictions are made for cells of so many pixels each way.
inline constexpr int kPriorCell = 4;
ATELIER_HOST_DEVICE inline int prior_cells(int pixels) {
  return (pixels + kPriorCell - 1) / kPriorCell;
}

/// e^x for x <= 0 to 3e-7 relative, with the same operations on both devices.
ATELIER_HOST_DEVICE inline float decay(float x) {
  if (x < -80.0f) {
    return 0;
  }
  // 2^k e^r with |r| <= ln(2) / 2; degree 6.
  const float k = std::floor(x * 1.44269504f + 0.5f);
  const float r = x - k * 0.693147182f;
  float sum = 1.0f / 720;
  sum = sum * r + 1.0f / 120;
  sum = sum * r + 1.0f / 24;
  sum = sum * r + 1.0f / 6;
  sum = sum * r + 0.5f;
  sum = sum * r + 1.0f;
  sum = sum * r + 1.0f;
  const std::uint32_t bits = static_cast<std::uint32_t>(static_cast<int>(k) + 127) << 23U;
  float power = 0;
  std::memcpy(&power, &bits, sizeof power);
  return sum * power;
}

/// The window around a reference pixel.
struct ReferenceWindow {
  float weight[kWindowSamples];  ///< sum 1
  float excess[kWindowSamples];  ///< weight times (value - mean)
  float centre;                  ///< value at the centre
  float mean;                    ///< weighted, less the value at the centre
  float variance;                ///< weighted
};

ATELIER_HOST_DEVICE inline ReferenceWindow window_at(const StereoProblem& problem, int x, int y) {
  ReferenceWindow window;
  window.centre = problem.image[y * problem.width + x];
  const float colour = -0.5f / (problem.colour_sigma * problem.colour_sigma);
  constexpr float kSpace = -0.5f / (kWindowRadius * kWindowRadius);
  float total = 0;
  for (int k = 0; k < kWindowSamples; ++k) {
    const int dx = window_x(k);
    const int dy = window_y(k);
    const int qx = x + dx;
    const int qy = y + dy;
    float weight = 0;
    float value = 0;
    if (qx >= 0 && qx < problem.width && qy >= 0 && qy < problem.height &&
        problem.near_depth[qy * problem.width + qx] > 0) {
      value = problem.image[qy * problem.width + qx] - window.centre;
      weight = decay(static_cast<float>(dx * dx + dy * dy) * kSpace + value * value * colour);
    }
    window.weight[k] = weight;
    window.excess[k] = value;
    total += weight;
  }
  const float scale = total > 0 ? 1 / total : 0;
  float mean = 0;
  for (int k = 0; k < kWindowSamples; ++k) {
    window.weight[k] *= scale;
    mean += window.weight[k] * window.excess[k];
  }
  window.mean = mean;
  window.variance = 0;
  for (int k = 0; k < kWindowSamples; ++k) {
    const float excess = window.excess[k] - mean;
    window.excess[k] = window.weight[k] * excess;
    window.variance += window.excess[k] * excess;
  }
  return window;
}

/// Direction through a pixel's centre with z = 1.
ATELIER_HOST_DEVICE inline Vec3f pixel_ray(const StereoProblem& problem, int x, int y) {
  return {(static_cast<float>(x) + 0.5f - problem.cx) / problem.fx,
          (static_cast<float>(y) + 0.5f - problem.cy) / problem.fy, 1.0f};
}

/// Depth at which the ray of a pixel meets the plane that another pixel lies on.
ATELIER_HOST_DEVICE inline float plane_depth(const StereoPlane& plane, Vec3f ray_of_plane,
                                             Vec3f ray) {
  return plane.depth * dot(plane.normal, ray_of_plane) / dot(plane.normal, ray);
}

/// Value between four pixels; (x, y) at least half a pixel inside.
ATELIER_HOST_DEVICE inline float bilinear(const float* image, int width, float x, float y) {
  const float left = x - 0.5f;
  const float top = y - 0.5f;
  const int column = static_cast<int>(left);
  const int row = static_cast<int>(top);
  const float u = left - static_cast<float>(column);
  const float v = top - static_cast<float>(row);
  const float* at = image + row * width + column;
  const float above = at[0] + u * (at[1] - at[0]);
  const float below = at[width] + u * (at[width + 1] - at[width]);
  return above + v * (below - above);
}

/// Where the window lands in a source: pixel ~ a + b dx + c dy.
struct WindowWarp {
  float a[3], b[3], c[3];
};

/// Weighted sums over the window's samples in a source, less the value at the window's centre.
struct WindowSums {
  float mean, square, product;
};

/// Takes them one sample after the other, in the order of eight lanes that vector code has.
struct ScalarSamples {
  ATELIER_HOST_DEVICE static WindowSums sums(const ReferenceWindow& window,
                                             const StereoSource& source, const WindowWarp& warp) {
    float mean[8] = {};
    float square[8] = {};
    float product[8] = {};
    for (int begin = 0; begin < kWindowSamples; begin += 8) {
      for (int lane = 0; lane < 8; ++lane) {
        const int k = begin + lane;
        const float dx = static_cast<float>(window_x(k));
        const float dy = static_cast<float>(window_y(k));
        const float scale = 1 / (warp.a[2] + warp.b[2] * dx + warp.c[2] * dy);
        const float x = (warp.a[0] + warp.b[0] * dx + warp.c[0] * dy) * scale;
        const float y = (warp.a[1] + warp.b[1] * dx + warp.c[1] * dy) * scale;
        const float value = bilinear(source.image, source.width, x, y) - window.centre;
        const float weighted = window.weight[k] * value;
        mean[lane] += weighted;
        square[lane] += weighted * value;
        product[lane] += window.excess[k] * value;
      }
    }
    WindowSums total = {0, 0, 0};
    for (int lane = 0; lane < 8; ++lane) {
      total.mean += mean[lane];
      total.square += square[lane];
      total.product += product[lane];
    }
    return total;
  }
};

/// Cost of a window carried over a plane into a source view, 0 (equal) to 2: 1 - weighted NCC, and
/// how far the two means are apart against the window's contrast. Correlation alone cannot place
/// bare shading: a slope of brightness looks like the same slope one pixel on, wherever it is, and
/// round limbs of smooth skin then come out too thin, as there is more room behind the surface than
/// before it. On a contrast above the floor the means say little and cost little. Our choice.
template <class Samples>
ATELIER_HOST_DEVICE inline float window_cost(const StereoProblem& problem,
                                             const ReferenceWindow& window,
                                             const StereoSource& source, int x, int y,
                                             const StereoPlane& plane) {
  constexpr float kMinVariance = 1e-6f;  // of values in [0,1]: below it there is only noise
  // Tolerance for exposure and gloss. Gloss adds as much light to dark surfaces as to bright ones,
  // which is more of a gamma-coded value v: in proportion to v^-1.2, near enough to 1 / v.
  constexpr float kLevelFloor = 0.02f;
  constexpr float kDark = 0.4f;  // black cloth and hair are below it, skin and most cloth are not
  const Vec3f ray = pixel_ray(problem, x, y);
  const float slope = dot(plane.normal, ray);
  if (!(slope < -0.05f) || !(plane.depth > 0) || window.variance < kMinVariance) {
    return kWorstCost;
  }
  // The homography of the plane is affine in the offset: numerator = a + b dx + c dy.
  const float inverse_distance = 1 / (slope * plane.depth);
  const float kx = plane.normal.x / problem.fx * inverse_distance;
  const float ky = plane.normal.y / problem.fy * inverse_distance;
  const float px = static_cast<float>(x) + 0.5f;
  const float py = static_cast<float>(y) + 0.5f;
  WindowWarp warp;
  for (int i = 0; i < 3; ++i) {
    const float* row = source.forth + 3 * i;
    warp.a[i] = row[0] * px + row[1] * py + row[2] + source.forth_t[i] / plane.depth;
    warp.b[i] = row[0] + source.forth_t[i] * kx;
    warp.c[i] = row[1] + source.forth_t[i] * ky;
  }
  // The window is inside the view if its corners are, as long as all are in front.
  for (int corner = 0; corner < 4; ++corner) {
    const float dx = (corner & 1) != 0 ? kWindowRadius : -kWindowRadius;
    const float dy = (corner & 2) != 0 ? kWindowRadius : -kWindowRadius;
    const float z = warp.a[2] + warp.b[2] * dx + warp.c[2] * dy;
    if (!(z > 1e-3f)) {
      return kWorstCost;
    }
    const float u = (warp.a[0] + warp.b[0] * dx + warp.c[0] * dy) / z;
    const float v = (warp.a[1] + warp.b[1] * dx + warp.c[1] * dy) / z;
    if (!(u >= 0.5f && v >= 0.5f && u < static_cast<float>(source.width) - 0.5f &&
          v < static_cast<float>(source.height) - 0.5f)) {
      return kWorstCost;
    }
  }
  const WindowSums sums = Samples::sums(window, source, warp);
  const float variance = sums.square - sums.mean * sums.mean;
  if (variance < kMinVariance) {
    return kWorstCost;
  }
  const float dark = kDark / std::fmax(window.centre + window.mean, 0.05f);
  const float allowed = kLevelFloor * (dark > 1 ? dark * std::sqrt(dark) : 1);
  const float level =
      std::fabs(sums.mean - window.mean) / std::sqrt(window.variance + allowed * allowed);
  const float cost = 1 - sums.product / std::sqrt(variance * window.variance) +
                     problem.level_weight * (level < 1 ? level : 1);
  return cost < 0 ? 0 : cost > kWorstCost ? kWorstCost : cost;
}

/// Depth of a source between its pixels: interpolated in its inverse, which is linear over a plane,
/// where the four agree, else the nearest pixel's. 0: none.
ATELIER_HOST_DEVICE inline float nearby_depth(const StereoSource& source, float u, float v) {
  const float nearest = source.depth[static_cast<int>(v) * source.width + static_cast<int>(u)];
  const float left = u - 0.5f;
  const float top = v - 0.5f;
  if (!(left >= 0 && top >= 0 && left < static_cast<float>(source.width - 1) &&
        top < static_cast<float>(source.height - 1))) {
    return nearest;
  }
  const int column = static_cast<int>(left);
  const int row = static_cast<int>(top);
  const float* at = source.depth + row * source.width + column;
  const float low =
      std::fmin(std::fmin(at[0], at[1]), std::fmin(at[source.width], at[source.width + 1]));
  const float high =
      std::fmax(std::fmax(at[0], at[1]), std::fmax(at[source.width], at[source.width + 1]));
  if (!(low > 0.98f * high)) {
    return nearest;
  }
  const float x = left - static_cast<float>(column);
  const float y = top - static_cast<float>(row);
  const float above = (1 - x) / at[0] + x / at[1];
  const float below = (1 - x) / at[source.width] + x / at[source.width + 1];
  return 1 / ((1 - y) * above + y * below);
}

/// How far a pixel lands from itself when it is carried to a source by its depth and back by the
/// source's own, in pixels beyond one; at most 3, also where the source knows no depth. One
/// pixel costs nothing: within it the windows know better than the other view's noisy depth (on a
/// textured ball the term else doubles the median error).
ATELIER_HOST_DEVICE inline float return_error(const StereoSource& source, int x, int y,
                                              float depth) {
  constexpr float kLargest = 3;
  const float px = static_cast<float>(x) + 0.5f;
  const float py = static_cast<float>(y) + 0.5f;
  float q[3];
  for (int i = 0; i < 3; ++i) {
    const float* row = source.forth + 3 * i;
    q[i] = row[0] * px + row[1] * py + row[2] + source.forth_t[i] / depth;
  }
  if (!(q[2] > 1e-3f)) {
    return kLargest;
  }
  const float u = q[0] / q[2];
  const float v = q[1] / q[2];
  if (!(u >= 0 && v >= 0 && u < static_cast<float>(source.width) &&
        v < static_cast<float>(source.height))) {
    return kLargest;
  }
  const float there = nearby_depth(source, u, v);
  if (!(there > 0)) {
    return kLargest;
  }
  float r[3];
  for (int i = 0; i < 3; ++i) {
    const float* row = source.back + 3 * i;
    r[i] = row[0] * u + row[1] * v + row[2] + source.back_t[i] / there;
  }
  const float ex = r[0] / r[2] - px;
  const float ey = r[1] / r[2] - py;
  const float error = std::sqrt(ex * ex + ey * ey) - 1.0f;
  return error < 0 ? 0 : error < kLargest ? error : kLargest;
}

/// Cost of a plane in one source: what its window says, and where the source's own depths are known
/// how well they agree.
template <class Samples>
ATELIER_HOST_DEVICE inline float plane_cost(const StereoProblem& problem,
                                            const ReferenceWindow& window,
                                            const StereoSource& source, int x, int y,
                                            const StereoPlane& plane) {
  float cost = window_cost<Samples>(problem, window, source, x, y, plane);
  if (source.depth != nullptr) {
    cost += problem.geometric_weight * return_error(source, x, y, plane.depth);
  }
  return cost;
}

}  // namespace atelier
