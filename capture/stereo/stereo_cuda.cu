#include <algorithm>

#include "capture/stereo/stereo_levels.h"
#include "core/cuda_buffer.cuh"
#include "core/cuda_check.h"

namespace atelier {
namespace {

constexpr int kBlockWidth = 32;
constexpr int kBlockHeight = 4;

/// One thread a pixel of one colour; neighbours in x are two pixels apart.
__global__ void __launch_bounds__(kBlockWidth* kBlockHeight)
    visit_kernel(StereoProblem problem, StereoPlane* planes, float* costs, int colour,
                 int iteration) {
  const int y = static_cast<int>(blockIdx.y * kBlockHeight + threadIdx.y);
  const int x = 2 * static_cast<int>(blockIdx.x * kBlockWidth + threadIdx.x) + ((y + colour) & 1);
  if (x >= problem.width || y >= problem.height ||
      !(problem.near_depth[y * problem.width + x] > 0)) {
    return;
  }
  const StereoBelief belief = visit_pixel<ScalarSamples>(problem, planes, costs, x, y, iteration);
  planes[y * problem.width + x] = belief.plane;
  costs[y * problem.width + x] = belief.cost;
}

__global__ void start_kernel(StereoProblem problem, StereoProblem coarse,
                             const StereoPlane* coarse_planes, StereoPlane* planes, float* costs) {
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (p >= problem.width * problem.height) {
    return;
  }
  StereoPlane plane = {0, {0, 0, -1}};
  if (problem.near_depth[p] > 0) {
    const int x = p % problem.width;
    const int y = p / problem.width;
    if (coarse_planes != nullptr) {
      plane = finer_plane(problem, coarse, coarse_planes, x, y);
    }
    if (!(plane.depth > 0)) {
      plane = first_plane(problem, x, y);
    }
  }
  planes[p] = plane;
  costs[p] = kWorstCost;
}

__global__ void depth_kernel(const StereoPlane* planes, float* depths, int count) {
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (p < count) {
    depths[p] = planes[p].depth;
  }
}

/// A view at one level on the device.
struct DeviceView {
  Camera camera;
  int width = 0;
  int height = 0;
  CudaBuffer<float> image, near_depth, far_depth, costs, depths;
  CudaBuffer<StereoPlane> planes;

  explicit DeviceView(const StereoLevel& level)
      : camera(level.camera),
        width(level.image.width),
        height(level.image.height),
        image(level.image.data),
        near_depth(level.near_depth.data),
        far_depth(level.far_depth.data),
        costs(level.image.data.size()),
        depths(level.image.data.size()),
        planes(level.image.data.size()) {}
  int pixels() const { return width * height; }
};

StereoProblem problem_of(const std::vector<DeviceView>& at, const std::vector<StereoView>& views,
                         const StereoOptions& options, std::size_t view, bool with_depths) {
  StereoLevel numbers;
  numbers.camera = at[view].camera;
  numbers.image.width = at[view].width;
  numbers.image.height = at[view].height;
  StereoProblem problem = stereo_problem(numbers, options, stereo_seed(options, view));
  problem.image = at[view].image.data();
  problem.near_depth = at[view].near_depth.data();
  problem.far_depth = at[view].far_depth.data();
  for (const int index : views[view].sources) {
    if (problem.sources == options.sources) {
      break;
    }
    const DeviceView& other = at[static_cast<std::size_t>(index)];
    StereoSource source = stereo_source(at[view].camera, other.camera);
    source.image = other.image.data();
    source.depth = with_depths ? other.depths.data() : nullptr;
    problem.source[problem.sources++] = source;
  }
  return problem;
}

int blocks_for(int count, int threads) {
  return (count + threads - 1) / threads;
}

void sweep(const StereoProblem& problem, DeviceView& view, int iteration) {
  const dim3 threads(kBlockWidth, kBlockHeight);
  const dim3 blocks(static_cast<unsigned>(blocks_for((view.width + 1) / 2, kBlockWidth)),
                    static_cast<unsigned>(blocks_for(view.height, kBlockHeight)));
  for (int colour = 0; colour < 2; ++colour) {
    visit_kernel<<<blocks, threads>>>(problem, view.planes.data(), view.costs.data(), colour,
                                      iteration);
    ATELIER_CUDA_CHECK(cudaGetLastError());
  }
}

}  // namespace

StereoResult stereo_cuda(const std::vector<StereoView>& views, const StereoOptions& options) {
  const std::vector<std::vector<StereoLevel>> levels = stereo_levels(views, options.levels);
  std::size_t deepest = 1;
  for (const std::vector<StereoLevel>& of_view : levels) {
    deepest = std::max(deepest, of_view.size());
  }
  std::vector<DeviceView> coarser;
  for (std::size_t down = 0; down < deepest; ++down) {
    const std::size_t level = deepest - 1 - down;
    const bool coarsest = down == 0;
    std::vector<DeviceView> at;
    at.reserve(views.size());
    for (const std::vector<StereoLevel>& of_view : levels) {
      at.emplace_back(of_view[std::min(level, of_view.size() - 1)]);
    }
    for (std::size_t i = 0; i < views.size(); ++i) {
      const StereoProblem problem = problem_of(at, views, options, i, false);
      const StereoProblem coarse =
          coarsest ? problem : problem_of(coarser, views, options, i, false);
      start_kernel<<<static_cast<unsigned>(blocks_for(at[i].pixels(), 256)), 256>>>(
          problem, coarse, coarsest ? nullptr : coarser[i].planes.data(), at[i].planes.data(),
          at[i].costs.data());
      ATELIER_CUDA_CHECK(cudaGetLastError());
      for (int iteration = 0; coarsest && iteration < options.iterations; ++iteration) {
        sweep(problem, at[i], iteration);
      }
    }
    for (int refinement = 0; refinement < options.refinements; ++refinement) {
      const bool agreeing = coarsest || refinement > 0;
      for (DeviceView& view : at) {
        depth_kernel<<<static_cast<unsigned>(blocks_for(view.pixels(), 256)), 256>>>(
            view.planes.data(), view.depths.data(), view.pixels());
        ATELIER_CUDA_CHECK(cudaGetLastError());
      }
      for (std::size_t i = 0; i < views.size(); ++i) {
        sweep(problem_of(at, views, options, i, agreeing), at[i],
              refinement_iteration(options, static_cast<int>(down), refinement));
      }
    }
    coarser = std::move(at);
  }
  StereoResult result;
  for (DeviceView& view : coarser) {
    result.planes.push_back(view.planes.download());
    result.costs.push_back(view.costs.download());
  }
  return result;
}

}  // namespace atelier
