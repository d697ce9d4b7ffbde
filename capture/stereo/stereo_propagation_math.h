#pragma once

#include <cmath>
#include <cstdint>

#include "capture/stereo/stereo_prior_math.h"
#include "core/random.h"

namespace atelier {

/// How a pixel finds its plane in PatchMatch stereo, shared by the CPU and CUDA twins.
///
/// The first one is random, or the coarser level's. Then pixels of one colour of a checkerboard
/// take over the planes of the other (Galliani 2015), from eight regions of which each offers its
/// best (Xu and Tao 2019, section 3.1), and the source views are weighted for each pixel by how the
/// eight hypotheses fare in them (section 3.2). Where a prior predicts a plane
/// (stereo_prior_math.h), that is one more hypothesis, and others cost by how far they are from it.
/// Variations of the best one follow.

/// Uniform in [0, 1) from a word.
ATELIER_HOST_DEVICE inline float unit_float(std::uint32_t word) {
  return static_cast<float>(word >> 8) * (1.0f / 16777216.0f);
}

/// A unit vector within 75 degrees or so of the ray back to the camera.
ATELIER_HOST_DEVICE inline Vec3f random_normal(Vec3f ray, std::uint32_t first,
                                               std::uint32_t second) {
  // A point of the unit disk by rejection-free squares, lifted to the hemisphere about -z.
  const float u = 1.9f * unit_float(first) - 0.95f;
  const float v = 1.9f * unit_float(second) - 0.95f;
  // Square to disk (elliptical map).
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

/// A pixel and what it is compared by.
struct StereoPixel {
  int x;
  int y;
  float near_depth;
  float far_depth;
  Vec3f ray;
  ReferenceWindow window;
};

ATELIER_HOST_DEVICE inline StereoPixel pixel_at(const StereoProblem& problem, int x, int y) {
  const int p = y * problem.width + x;
  return {x,
          y,
          problem.near_depth[p],
          problem.far_depth[p],
          pixel_ray(problem, x, y),
          window_at(problem, x, y)};
}

/// Planes that a pixel chooses from, and the cost of each in every source.
struct StereoHypotheses {
  StereoPlane candidate[10];
  float cost[10][kLargestSources];
  int count;
  StereoPlane predicted;  ///< by the prior; depth 0: none
};

/// Its own plane, those of the eight regions, and the predicted one.
template <class Samples>
ATELIER_HOST_DEVICE inline void find_hypotheses(const StereoProblem& problem,
                                                const StereoPlane* planes, const float* costs,
                                                const StereoPixel& pixel, StereoHypotheses& found) {
  found.count = 0;
  found.candidate[found.count++] = planes[pixel.y * problem.width + pixel.x];
  for (int region = 0; region < 8; ++region) {
    const int q = best_of_region(problem, planes, costs, pixel.x, pixel.y, region);
    if (q < 0) {
      continue;
    }
    StereoPlane plane = planes[q];
    plane.depth =
        plane_depth(plane, pixel_ray(problem, q % problem.width, q / problem.width), pixel.ray);
    if (plane.depth >= pixel.near_depth && plane.depth <= pixel.far_depth) {
      found.candidate[found.count++] = plane;
    }
  }
  found.predicted = predicted_at(problem, pixel.ray, pixel.x, pixel.y);
  if (found.predicted.depth >= pixel.near_depth && found.predicted.depth <= pixel.far_depth) {
    found.candidate[found.count++] = found.predicted;
  } else {
    found.predicted.depth = 0;
  }
  for (int i = 0; i < found.count; ++i) {
    for (int j = 0; j < problem.sources; ++j) {
      found.cost[i][j] = plane_cost<Samples>(problem, pixel.window, problem.source[j], pixel.x,
                                             pixel.y, found.candidate[i]);
    }
  }
}

/// Weight of each source view at a pixel.
struct SourceWeights {
  float of[kLargestSources];
  float total;  ///< 0: no source sees it
};

/// How good the good hypotheses are in each source (Xu and Tao 2019, equations 2-5).
ATELIER_HOST_DEVICE inline SourceWeights source_weights(const StereoProblem& problem,
                                                        const StereoHypotheses& hypotheses,
                                                        int iteration) {
  const float t = static_cast<float>(iteration);
  const float good_below = 0.8f * decay(-t * t / 90);
  constexpr float kBadAbove = 1.2f;
  constexpr float kFall = -0.5f / (0.3f * 0.3f);
  SourceWeights weight;
  weight.total = 0;
  for (int j = 0; j < problem.sources; ++j) {
    int good = 0;
    int bad = 0;
    float sum = 0;
    for (int i = 0; i < hypotheses.count; ++i) {
      const float cost = hypotheses.cost[i][j];
      if (cost < good_below) {
        ++good;
        sum += decay(kFall * cost * cost);
      } else if (cost > kBadAbove) {
        ++bad;
      }
    }
    weight.of[j] = good >= 2 && bad < 4 ? sum / static_cast<float>(good) : 0;
    weight.total += weight.of[j];
  }
  if (weight.total > 0) {
    return weight;
  }
  // No source stands out: the two in which something fares best count.
  for (int round = 0; round < 2; ++round) {
    int best = -1;
    float least = kWorstCost;
    for (int j = 0; j < problem.sources; ++j) {
      for (int i = 0; i < hypotheses.count; ++i) {
        if (weight.of[j] == 0 && hypotheses.cost[i][j] < least) {
          least = hypotheses.cost[i][j];
          best = j;
        }
      }
    }
    if (best >= 0) {
      weight.of[best] = 1;
      weight.total += 1;
    }
  }
  return weight;
}

/// The hypothesis of least cost. `weight.total` is above 0.
/// @param plain  plainness of the pixel's window
ATELIER_HOST_DEVICE inline StereoBelief best_hypothesis(const StereoProblem& problem,
                                                        const StereoHypotheses& hypotheses,
                                                        const SourceWeights& weight, float plain) {
  StereoBelief belief = {hypotheses.candidate[0], kWorstCost};
  for (int i = 0; i < hypotheses.count; ++i) {
    float sum = 0;
    for (int j = 0; j < problem.sources; ++j) {
      sum += weight.of[j] * hypotheses.cost[i][j];
    }
    sum = sum / weight.total +
          plain * prior_doubt(problem, hypotheses.predicted, hypotheses.candidate[i]);
    if (sum < belief.cost || i == 0) {
      belief = {hypotheses.candidate[i], sum};
    }
  }
  return belief;
}

/// One of four variations of a plane: a random plane, another depth, another normal, a little of
/// both. They shrink with the iterations.
ATELIER_HOST_DEVICE inline StereoPlane varied_plane(StereoPlane plane, const StereoPixel& pixel,
                                                    int trial, int iteration, RandomWords first,
                                                    RandomWords second) {
  const float shrink = 1.0f / static_cast<float>(1 << (iteration < 6 ? iteration : 6));
  const float span = 1 / pixel.near_depth - 1 / pixel.far_depth;
  if (trial == 0) {
    plane.depth = random_depth(pixel.near_depth, pixel.far_depth, unit_float(first.word[0]));
    plane.normal = random_normal(pixel.ray, first.word[1], first.word[2]);
  } else if (trial == 1) {
    plane.depth =
        1 / (1 / plane.depth + 0.1f * shrink * span * (2 * unit_float(first.word[3]) - 1));
  } else if (trial == 2) {
    plane.normal = near_normal(plane.normal, pixel.ray, 0.5f * shrink, second);
  } else {
    plane.depth =
        1 / (1 / plane.depth + 0.02f * shrink * span * (2 * unit_float(second.word[3]) - 1));
    plane.normal = near_normal(plane.normal, pixel.ray, 0.15f * shrink, first);
  }
  return plane;
}

/// One visit of a pixel: takes over what neighbours believe, then tries variations.
/// @param iteration  from 0: variations shrink
template <class Samples>
ATELIER_HOST_DEVICE inline StereoBelief visit_pixel(const StereoProblem& problem,
                                                    const StereoPlane* planes, const float* costs,
                                                    int x, int y, int iteration) {
  const StereoPixel pixel = pixel_at(problem, x, y);
  StereoHypotheses hypotheses;
  find_hypotheses<Samples>(problem, planes, costs, pixel, hypotheses);
  const SourceWeights weight = source_weights(problem, hypotheses, iteration);
  if (!(weight.total > 0)) {
    return {hypotheses.candidate[0], kWorstCost};  // no source sees it
  }
  const float plain = plainness(pixel.window);
  StereoBelief belief = best_hypothesis(problem, hypotheses, weight, plain);

  const auto p = static_cast<std::uint64_t>(y * problem.width + x);
  const auto stream = static_cast<std::uint64_t>(iteration) + 1;
  const RandomWords first = random_words(problem.seed, stream, 2 * p);
  const RandomWords second = random_words(problem.seed, stream, 2 * p + 1);
  for (int trial = 0; trial < 4; ++trial) {
    const StereoPlane plane = varied_plane(belief.plane, pixel, trial, iteration, first, second);
    if (!(plane.depth >= pixel.near_depth && plane.depth <= pixel.far_depth)) {
      continue;
    }
    float sum = weight.total * plain * prior_doubt(problem, hypotheses.predicted, plane);
    const float enough = belief.cost * weight.total;
    for (int j = 0; j < problem.sources && sum < enough; ++j) {
      if (weight.of[j] > 0) {
        sum += weight.of[j] *
               plane_cost<Samples>(problem, pixel.window, problem.source[j], x, y, plane);
      }
    }
    if (sum < enough) {
      belief = {plane, sum / weight.total};
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
