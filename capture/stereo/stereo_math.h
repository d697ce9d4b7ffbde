#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/host_device.h"
#include "core/random.h"
#include "core/vec.h"

namespace atelier {

/// The arithmetic of PatchMatch stereo for one pixel, shared by the CPU and CUDA twins.
///
/// A pixel's hypothesis is a plane in its camera's frame (Bleyer 2011). It is judged by how well a
/// window around the pixel, carried over the plane into a source view, agrees with what that view
/// sees: bilaterally weighted normalised cross-correlation (Schoenberger 2016, section 4). Pixels
/// of one colour of a checkerboard take over the planes of the other (Galliani 2015), from eight
/// regions of which each offers its best (Xu and Tao 2019, section 3.1), and the source views are
/// weighted for each pixel by how the eight hypotheses fare in them (section 3.2). Where a prior
/// predicts a plane (stereo_prior_math.h), that is one more hypothesis, and others cost by how far
/// they are from it.

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

/// What a pixel believes: it lies on this plane.
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
  constexpr float kLeastVariance = 1e-6f;  // of values in [0,1]: below it there is only noise
  constexpr float kLevelFloor = 0.02f;     // what exposures and gloss may be off
  const Vec3f ray = pixel_ray(problem, x, y);
  const float slope = dot(plane.normal, ray);
  if (!(slope < -0.05f) || !(plane.depth > 0) || window.variance < kLeastVariance) {
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
  if (variance < kLeastVariance) {
    return kWorstCost;
  }
  const float level =
      std::fabs(sums.mean - window.mean) / std::sqrt(window.variance + kLevelFloor * kLevelFloor);
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

/// Uniform in [0, 1) from a word.
ATELIER_HOST_DEVICE inline float unit_float(std::uint32_t word) {
  return static_cast<float>(word >> 8) * (1.0f / 16777216.0f);
}

/// A unit vector within 75 degrees or so of the ray back to the camera.
ATELIER_HOST_DEVICE inline Vec3f random_normal(Vec3f ray, std::uint32_t first,
                                               std::uint32_t second) {
  // A point of the unit disc by rejection-free squares, lifted to the hemisphere about -z.
  const float u = 1.9f * unit_float(first) - 0.95f;
  const float v = 1.9f * unit_float(second) - 0.95f;
  // Square to disc (elliptical map).
  const float x = u * std::sqrt(1 - 0.5f * v * v);
  const float y = v * std::sqrt(1 - 0.5f * u * u);
  const float z2 = 1 - x * x - y * y;
  Vec3f normal = {x, y, -std::sqrt(z2 > 0.05f ? z2 : 0.05f)};
  normal = (1 / norm(normal)) * normal;
  return dot(normal, ray) < 0 ? normal : (-1 / norm(ray)) * ray;
}

/// A normal near another one, still towards the camera.
ATELIER_HOST_DEVICE inline Vec3f near_normal(Vec3f normal, Vec3f ray, float amount,
                                             RandomWords words) {
  Vec3f moved = {normal.x + amount * (2 * unit_float(words.word[0]) - 1),
                 normal.y + amount * (2 * unit_float(words.word[1]) - 1),
                 normal.z + amount * (2 * unit_float(words.word[2]) - 1)};
  moved = (1 / norm(moved)) * moved;
  return dot(moved, ray) < -0.05f * norm(ray) ? moved : normal;
}

/// Depth between the bounds, uniform in its inverse.
ATELIER_HOST_DEVICE inline float random_depth(float near_depth, float far_depth, float unit) {
  return 1 / (1 / near_depth + unit * (1 / far_depth - 1 / near_depth));
}

/// The pixel of a region that believes its plane most, or -1. Regions 0 to 3 are near (a wedge), 4
/// to 7 far (a strip) in the four directions; all their pixels have the other colour.
ATELIER_HOST_DEVICE inline int best_of_region(const StereoProblem& problem,
                                              const StereoPlane* planes, const float* costs, int x,
                                              int y, int region) {
  const int direction = region & 3;
  const int ux = direction == 0 ? 1 : direction == 1 ? -1 : 0;
  const int uy = direction == 2 ? 1 : direction == 3 ? -1 : 0;
  int best = -1;
  float least = 1e9f;
  const int count = region < 4 ? 7 : 11;
  for (int k = 0; k < count; ++k) {
    int along = 0;
    int across = 0;
    if (region < 4) {  // (1,0), (2,+-1), (3,+-2), (4,+-3)
      along = 1 + (k + 1) / 2;
      across = (k & 1) != 0 ? (k + 1) / 2 : -(k / 2);
    } else {  // (3,0), (5,0), ... (23,0)
      along = 3 + 2 * k;
      across = 0;
    }
    const int qx = x + ux * along + uy * across;
    const int qy = y + uy * along + ux * across;
    if (qx < 0 || qy < 0 || qx >= problem.width || qy >= problem.height) {
      continue;
    }
    const int q = qy * problem.width + qx;
    if (planes[q].depth > 0 && costs[q] < least) {
      least = costs[q];
      best = q;
    }
  }
  return best;
}

/// A pixel's plane and its cost.
struct StereoBelief {
  StereoPlane plane;
  float cost;
};

/// A random plane within the pixel's bounds.
ATELIER_HOST_DEVICE inline StereoPlane first_plane(const StereoProblem& problem, int x, int y) {
  const int p = y * problem.width + x;
  const RandomWords words = random_words(problem.seed, 0, static_cast<std::uint64_t>(p));
  return {random_depth(problem.near_depth[p], problem.far_depth[p], unit_float(words.word[0])),
          random_normal(pixel_ray(problem, x, y), words.word[1], words.word[2])};
}

/// What the prior predicts for a pixel; depth 0: nothing.
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

/// One visit of a pixel: takes over what neighbours believe, then tries variations.
/// @param iteration  from 0: variations shrink
template <class Samples>
ATELIER_HOST_DEVICE inline StereoBelief visit_pixel(const StereoProblem& problem,
                                                    const StereoPlane* planes, const float* costs,
                                                    int x, int y, int iteration) {
  const int p = y * problem.width + x;
  const float near_depth = problem.near_depth[p];
  const float far_depth = problem.far_depth[p];
  const Vec3f ray = pixel_ray(problem, x, y);
  const ReferenceWindow window = window_at(problem, x, y);

  // Hypotheses: its own, those of the eight regions, and the predicted one.
  StereoPlane candidate[10];
  float cost[10][kLargestSources];
  int candidates = 0;
  candidate[candidates++] = planes[p];
  for (int region = 0; region < 8; ++region) {
    const int q = best_of_region(problem, planes, costs, x, y, region);
    if (q < 0) {
      continue;
    }
    StereoPlane plane = planes[q];
    plane.depth = plane_depth(plane, pixel_ray(problem, q % problem.width, q / problem.width), ray);
    if (plane.depth >= near_depth && plane.depth <= far_depth) {
      candidate[candidates++] = plane;
    }
  }
  const float plain = plainness(window);
  StereoPlane predicted = predicted_at(problem, ray, x, y);
  if (predicted.depth >= near_depth && predicted.depth <= far_depth) {
    candidate[candidates++] = predicted;
  } else {
    predicted.depth = 0;
  }
  for (int i = 0; i < candidates; ++i) {
    for (int j = 0; j < problem.sources; ++j) {
      cost[i][j] = plane_cost<Samples>(problem, window, problem.source[j], x, y, candidate[i]);
    }
  }

  // Weight of each source: how good the good hypotheses are in it (Xu and Tao 2019, equations 2-5).
  const float t = static_cast<float>(iteration);
  const float good_below = 0.8f * decay(-t * t / 90);
  constexpr float kBadAbove = 1.2f;
  constexpr float kFall = -0.5f / (0.3f * 0.3f);
  float weight[kLargestSources];
  float total = 0;
  for (int j = 0; j < problem.sources; ++j) {
    int good = 0;
    int bad = 0;
    float sum = 0;
    for (int i = 0; i < candidates; ++i) {
      if (cost[i][j] < good_below) {
        ++good;
        sum += decay(kFall * cost[i][j] * cost[i][j]);
      } else if (cost[i][j] > kBadAbove) {
        ++bad;
      }
    }
    weight[j] = good >= 2 && bad < 4 ? sum / static_cast<float>(good) : 0;
    total += weight[j];
  }
  if (!(total > 0)) {
    // No source stands out: the two in which something fares best count.
    for (int round = 0; round < 2; ++round) {
      int best = -1;
      float least = kWorstCost;
      for (int j = 0; j < problem.sources; ++j) {
        for (int i = 0; i < candidates; ++i) {
          if (weight[j] == 0 && cost[i][j] < least) {
            least = cost[i][j];
            best = j;
          }
        }
      }
      if (best >= 0) {
        weight[best] = 1;
        total += 1;
      }
    }
  }
  StereoBelief belief = {candidate[0], kWorstCost};
  if (!(total > 0)) {
    return belief;  // no source sees it
  }
  for (int i = 0; i < candidates; ++i) {
    float sum = 0;
    for (int j = 0; j < problem.sources; ++j) {
      sum += weight[j] * cost[i][j];
    }
    sum = sum / total + plain * prior_doubt(problem, predicted, candidate[i]);
    if (sum < belief.cost || i == 0) {
      belief = {candidate[i], sum};
    }
  }

  // Variations of the best.
  const auto stream = static_cast<std::uint64_t>(iteration) + 1;
  const RandomWords first = random_words(problem.seed, stream, 2 * static_cast<std::uint64_t>(p));
  const RandomWords second =
      random_words(problem.seed, stream, 2 * static_cast<std::uint64_t>(p) + 1);
  const float shrink = 1.0f / static_cast<float>(1 << (iteration < 6 ? iteration : 6));
  const float span = 1 / near_depth - 1 / far_depth;
  for (int trial = 0; trial < 4; ++trial) {
    StereoPlane plane = belief.plane;
    if (trial == 0) {
      plane.depth = random_depth(near_depth, far_depth, unit_float(first.word[0]));
      plane.normal = random_normal(ray, first.word[1], first.word[2]);
    } else if (trial == 1) {
      plane.depth =
          1 / (1 / plane.depth + 0.1f * shrink * span * (2 * unit_float(first.word[3]) - 1));
    } else if (trial == 2) {
      plane.normal = near_normal(plane.normal, ray, 0.5f * shrink, second);
    } else {
      plane.depth =
          1 / (1 / plane.depth + 0.02f * shrink * span * (2 * unit_float(second.word[3]) - 1));
      plane.normal = near_normal(plane.normal, ray, 0.15f * shrink, first);
    }
    if (!(plane.depth >= near_depth && plane.depth <= far_depth)) {
      continue;
    }
    float sum = total * plain * prior_doubt(problem, predicted, plane);
    const float enough = belief.cost * total;
    for (int j = 0; j < problem.sources && sum < enough; ++j) {
      if (weight[j] > 0) {
        sum += weight[j] * plane_cost<Samples>(problem, window, problem.source[j], x, y, plane);
      }
    }
    if (sum < enough) {
      belief = {plane, sum / total};
    }
  }
  return belief;
}

/// The plane that a pixel of the next finer level starts from: of the four coarse pixels around it
/// the one whose value is nearest. Depth 0 where none of them believes anything.
ATELIER_HOST_DEVICE inline StereoPlane finer_plane(const StereoProblem& fine,
                                                   const StereoProblem& coarse,
                                                   const StereoPlane* coarse_planes, int x, int y) {
  const int p = y * fine.width + x;
  if (coarse.width == fine.width) {
    return coarse_planes[p];  // too small to be halved
  }
  const Vec3f ray = pixel_ray(fine, x, y);
  StereoPlane best = {0, {0, 0, -1}};
  float least = 1e9f;
  for (int k = 0; k < 4; ++k) {
    // The coarse pixel that holds it, and its neighbours on the nearer sides.
    const int cx = x / 2 + ((k & 1) != 0 ? ((x & 1) != 0 ? 1 : -1) : 0);
    const int cy = y / 2 + ((k & 2) != 0 ? ((y & 1) != 0 ? 1 : -1) : 0);
    if (cx < 0 || cy < 0 || cx >= coarse.width || cy >= coarse.height) {
      continue;
    }
    const StereoPlane plane = coarse_planes[cy * coarse.width + cx];
    if (!(plane.depth > 0) || !(dot(plane.normal, ray) < -0.02f)) {
      continue;
    }
    const float difference =
        std::fabs(fine.image[p] - coarse.image[cy * coarse.width + cx]) + 0.001f * (k == 0 ? 0 : 1);
    if (difference < least) {
      const float depth = plane_depth(plane, pixel_ray(coarse, cx, cy), ray);
      if (depth >= fine.near_depth[p] && depth <= fine.far_depth[p]) {
        least = difference;
        best = {depth, plane.normal};
      }
    }
  }
  return best;
}

}  // namespace atelier
