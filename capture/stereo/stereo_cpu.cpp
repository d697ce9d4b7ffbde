#include <algorithm>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "capture/stereo/stereo_levels.h"
#include "core/parallel.h"

namespace atelier {
namespace {

/// Rows [begin, end) of one colour of the checkerboard.
template <class Samples>
inline void visit_rows(const StereoProblem& problem, StereoPlane* planes, float* costs, int colour,
                       int iteration, int begin, int end) {
  for (int y = begin; y < end; ++y) {
    for (int x = (y + colour) & 1; x < problem.width; x += 2) {
      const int p = y * problem.width + x;
      if (problem.near_depth[p] > 0) {
        const StereoBelief belief = visit_pixel<Samples>(problem, planes, costs, x, y, iteration);
        planes[p] = belief.plane;
        costs[p] = belief.cost;
      }
    }
  }
}

void visit_rows_scalar(const StereoProblem& problem, StereoPlane* planes, float* costs, int colour,
                       int iteration, int begin, int end) {
  visit_rows<ScalarSamples>(problem, planes, costs, colour, iteration, begin, end);
}

#if defined(__x86_64__)
#define ATELIER_AVX2 __attribute__((target("avx2")))

struct WindowOffsets {
  float x[kWindowSamples];
  float y[kWindowSamples];
};

constexpr WindowOffsets window_offsets() {
  WindowOffsets offsets{};
  for (int k = 0; k < kWindowSamples; ++k) {
    offsets.x[k] = static_cast<float>(window_x(k));
    offsets.y[k] = static_cast<float>(window_y(k));
  }
  return offsets;
}

/// The same operations in the same order, eight lanes at once; without FMA, so with the same bits.
struct Avx2Samples {
  ATELIER_AVX2 static float sum(__m256 lanes) {
    alignas(32) float value[8];
    _mm256_store_ps(value, lanes);
    float total = 0;
    for (const float lane : value) {
      total += lane;
    }
    return total;
  }
  ATELIER_AVX2 static __m256 affine(float a, float b, float c, __m256 dx, __m256 dy) {
    return _mm256_add_ps(_mm256_add_ps(_mm256_set1_ps(a), _mm256_mul_ps(_mm256_set1_ps(b), dx)),
                         _mm256_mul_ps(_mm256_set1_ps(c), dy));
  }
  /// Left and right of eight pairs of neighbours: pairs are loaded as one double each.
  struct Pairs {
    __m256 left, right;
  };
  ATELIER_AVX2 static __m256 in_order(__m256 lanes) {
    return _mm256_castpd_ps(_mm256_permute4x64_pd(_mm256_castps_pd(lanes), 0b11011000));
  }
  ATELIER_AVX2 static Pairs pairs(const float* image, __m256i index) {
    // With an explicit mask: of the plain gather GCC says that its source is not initialised.
    const auto* base = reinterpret_cast<const double*>(image);
    const __m256d none = _mm256_setzero_pd();
    const __m256d all = _mm256_cmp_pd(none, none, _CMP_EQ_OQ);
    const __m256 low = _mm256_castpd_ps(
        _mm256_mask_i32gather_pd(none, base, _mm256_castsi256_si128(index), all, 4));
    const __m256 high = _mm256_castpd_ps(
        _mm256_mask_i32gather_pd(none, base, _mm256_extracti128_si256(index, 1), all, 4));
    // Lanes 0 1 4 5 2 3 6 7 after the shuffle; the permutation puts them in order.
    return {in_order(_mm256_shuffle_ps(low, high, 0b10001000)),
            in_order(_mm256_shuffle_ps(low, high, 0b11011101))};
  }

  ATELIER_AVX2 static WindowSums sums(const ReferenceWindow& window, const StereoSource& source,
                                      const WindowWarp& warp) {
    static constexpr WindowOffsets kOffsets = window_offsets();
    const __m256 half = _mm256_set1_ps(0.5f);
    const __m256i width = _mm256_set1_epi32(source.width);
    __m256 mean = _mm256_setzero_ps();
    __m256 square = _mm256_setzero_ps();
    __m256 product = _mm256_setzero_ps();
    for (int begin = 0; begin < kWindowSamples; begin += 8) {
      const __m256 dx = _mm256_loadu_ps(kOffsets.x + begin);
      const __m256 dy = _mm256_loadu_ps(kOffsets.y + begin);
      const __m256 scale =
          _mm256_div_ps(_mm256_set1_ps(1), affine(warp.a[2], warp.b[2], warp.c[2], dx, dy));
      const __m256 left = _mm256_sub_ps(
          _mm256_mul_ps(affine(warp.a[0], warp.b[0], warp.c[0], dx, dy), scale), half);
      const __m256 top = _mm256_sub_ps(
          _mm256_mul_ps(affine(warp.a[1], warp.b[1], warp.c[1], dx, dy), scale), half);
      const __m256i column = _mm256_cvttps_epi32(left);
      const __m256i row = _mm256_cvttps_epi32(top);
      const __m256 u = _mm256_sub_ps(left, _mm256_cvtepi32_ps(column));
      const __m256 v = _mm256_sub_ps(top, _mm256_cvtepi32_ps(row));
      const __m256i index = _mm256_add_epi32(_mm256_mullo_epi32(row, width), column);
      const Pairs upper = pairs(source.image, index);
      const Pairs lower = pairs(source.image, _mm256_add_epi32(index, width));
      const __m256 above =
          _mm256_add_ps(upper.left, _mm256_mul_ps(u, _mm256_sub_ps(upper.right, upper.left)));
      const __m256 below =
          _mm256_add_ps(lower.left, _mm256_mul_ps(u, _mm256_sub_ps(lower.right, lower.left)));
      const __m256 value =
          _mm256_sub_ps(_mm256_add_ps(above, _mm256_mul_ps(v, _mm256_sub_ps(below, above))),
                        _mm256_set1_ps(window.centre));
      const __m256 weighted = _mm256_mul_ps(_mm256_loadu_ps(window.weight + begin), value);
      mean = _mm256_add_ps(mean, weighted);
      square = _mm256_add_ps(square, _mm256_mul_ps(weighted, value));
      product =
          _mm256_add_ps(product, _mm256_mul_ps(_mm256_loadu_ps(window.excess + begin), value));
    }
    return {sum(mean), sum(square), sum(product)};
  }
};

ATELIER_AVX2 __attribute__((flatten)) void visit_rows_avx2(const StereoProblem& problem,
                                                           StereoPlane* planes, float* costs,
                                                           int colour, int iteration, int begin,
                                                           int end) {
  visit_rows<Avx2Samples>(problem, planes, costs, colour, iteration, begin, end);
}
#endif

auto* rows_visitor(const std::string& vectors) {
#if defined(__x86_64__)
  if (vectors == "avx2" || (vectors == "auto" && __builtin_cpu_supports("avx2") != 0)) {
    return &visit_rows_avx2;
  }
#endif
  return &visit_rows_scalar;
}

void sweep(const StereoProblem& problem, std::vector<StereoPlane>& planes,
           std::vector<float>& costs, int iteration, const std::string& vectors) {
  auto* const visit = rows_visitor(vectors);
  for (int colour = 0; colour < 2; ++colour) {
    parallel_for(problem.height, 4, [&](Index begin, Index end) {
      visit(problem, planes.data(), costs.data(), colour, iteration, static_cast<int>(begin),
            static_cast<int>(end));
    });
  }
}

/// A view's hypotheses at one level.
struct Belief {
  std::vector<StereoPlane> planes;
  std::vector<float> costs;
};

StereoProblem problem_of(const StereoLevels& levels, std::size_t level,
                         const StereoOptions& options, std::size_t view,
                         const std::vector<std::vector<float>>* depths) {
  const Camera& camera = levels.camera(view, level);
  StereoProblem problem = stereo_problem(camera, options, stereo_seed(options, view));
  problem.image = levels.image(view, level).data.data();
  problem.near_depth = levels.near_depth(view, level).data.data();
  problem.far_depth = levels.far_depth(view, level).data.data();
  for (const int index : levels.views[view].sources) {
    if (problem.sources == options.sources) {
      break;
    }
    const auto other = static_cast<std::size_t>(index);
    StereoSource source = stereo_source(camera, levels.camera(other, level));
    source.image = levels.image(other, level).data.data();
    source.depth = depths == nullptr ? nullptr : (*depths)[other].data();
    problem.source[problem.sources++] = source;
  }
  return problem;
}

std::vector<std::vector<float>> depths_of(const std::vector<Belief>& beliefs) {
  std::vector<std::vector<float>> depths;
  for (const Belief& belief : beliefs) {
    std::vector<float>& depth = depths.emplace_back(belief.planes.size());
    std::transform(belief.planes.begin(), belief.planes.end(), depth.begin(),
                   [](const StereoPlane& plane) { return plane.depth; });
  }
  return depths;
}

/// Predictions of the prior for every cell of a view.
std::vector<Vec3f> predicted_planes(const StereoProblem& problem, const Belief& belief) {
  const int columns = prior_cells(problem.width);
  const int rows = prior_cells(problem.height);
  std::vector<PriorMoments> moments(static_cast<std::size_t>(columns) * rows);
  std::vector<Vec3f> planes(moments.size());
  parallel_for(rows, 4, [&](Index begin, Index end) {
    for (auto cell = begin * columns; cell < end * columns; ++cell) {
      moments[static_cast<std::size_t>(cell)] =
          cell_moments(problem, belief.planes.data(), belief.costs.data(),
                       static_cast<int>(cell % columns), static_cast<int>(cell / columns));
    }
  });
  parallel_for(rows, 4, [&](Index begin, Index end) {
    for (auto cell = begin * columns; cell < end * columns; ++cell) {
      planes[static_cast<std::size_t>(cell)] =
          predicted_plane(problem, moments.data(), static_cast<int>(cell % columns),
                          static_cast<int>(cell / columns));
    }
  });
  return planes;
}

DepthMap depth_map_of(const Camera& camera, const Belief& belief) {
  DepthMap map = empty_depth_map(camera);
  const WorldFromCamera axes = world_from_camera(camera);
  for (std::size_t i = 0; i < belief.planes.size(); ++i) {
    if (!(belief.planes[i].depth > 0)) {
      continue;
    }
    map.depth.data[i] = belief.planes[i].depth;
    const Vec3f normal = world_normal(axes, belief.planes[i].normal);
    map.normal.data[3 * i] = normal.x;
    map.normal.data[3 * i + 1] = normal.y;
    map.normal.data[3 * i + 2] = normal.z;
    map.confidence.data[i] = confidence_of(belief.costs[i]);
  }
  return map;
}

/// First planes: random on the coarsest level, from the coarser one elsewhere.
void start_planes(const StereoProblem& problem, const StereoProblem* coarse,
                  const std::vector<StereoPlane>* coarse_planes, std::vector<StereoPlane>& planes) {
  planes.assign(static_cast<std::size_t>(problem.width) * problem.height, {0, {0, 0, -1}});
  for (int y = 0; y < problem.height; ++y) {
    for (int x = 0; x < problem.width; ++x) {
      const int p = y * problem.width + x;
      if (!(problem.near_depth[p] > 0)) {
        continue;
      }
      StereoPlane plane = {0, {0, 0, -1}};
      if (coarse != nullptr) {
        plane = finer_plane(problem, *coarse, coarse_planes->data(), x, y);
      }
      planes[static_cast<std::size_t>(p)] = plane.depth > 0 ? plane : first_plane(problem, x, y);
    }
  }
}

}  // namespace

std::vector<DepthMap> stereo_cpu(const std::vector<StereoView>& views,
                                 const StereoOptions& options) {
  const StereoLevels levels = stereo_levels(views, options.levels);
  std::vector<Belief> beliefs(views.size());
  for (std::size_t down = 0; down <= levels.deepest; ++down) {
    const std::size_t level = levels.deepest - down;
    const bool coarsest = down == 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      Belief& belief = beliefs[i];
      const StereoProblem problem = problem_of(levels, level, options, i, nullptr);
      if (coarsest) {
        start_planes(problem, nullptr, nullptr, belief.planes);
      } else {
        const StereoProblem coarse = problem_of(levels, level + 1, options, i, nullptr);
        const std::vector<StereoPlane> coarse_planes = std::move(belief.planes);
        start_planes(problem, &coarse, &coarse_planes, belief.planes);
      }
      belief.costs.assign(belief.planes.size(), kWorstCost);
      for (int iteration = 0; coarsest && iteration < options.iterations; ++iteration) {
        sweep(problem, belief.planes, belief.costs, iteration, options.vectors);
      }
    }
    // The first sweep on a finer level has no depths of that level to agree with.
    for (int refinement = 0; refinement < options.refinements; ++refinement) {
      const bool agreeing = coarsest || refinement > 0;
      const std::vector<std::vector<float>> depths =
          agreeing ? depths_of(beliefs) : std::vector<std::vector<float>>();
      for (std::size_t i = 0; i < views.size(); ++i) {
        StereoProblem problem = problem_of(levels, level, options, i, agreeing ? &depths : nullptr);
        std::vector<Vec3f> predicted;
        if (uses_prior(options, refinement)) {
          predicted = predicted_planes(problem, beliefs[i]);
          problem.prior = predicted.data();
        }
        sweep(problem, beliefs[i].planes, beliefs[i].costs,
              refinement_iteration(options, static_cast<int>(down), refinement), options.vectors);
      }
    }
  }
  std::vector<DepthMap> maps(views.size());
  parallel_for(static_cast<Index>(views.size()), 1, [&](Index begin, Index end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      maps[i] = depth_map_of(views[i].camera, beliefs[i]);
    }
  });
  return maps;
}

}  // namespace atelier
