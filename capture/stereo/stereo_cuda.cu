#include <algorithm>

#include "capture/stereo/stereo_levels.h"
#include "core/cuda_buffer.cuh"
#include "core/cuda_check.h"
#include "core/parallel.h"

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

__global__ void moments_kernel(StereoProblem problem, const StereoPlane* planes, const float* costs,
                               PriorMoments* moments, int cells) {
  const int cell = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (cell < cells) {
    const int columns = prior_cells(problem.width);
    moments[cell] = cell_moments(problem, planes, costs, cell % columns, cell / columns);
  }
}

__global__ void predict_kernel(StereoProblem problem, const PriorMoments* moments, Vec3f* planes,
                               int cells) {
  const int cell = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (cell < cells) {
    const int columns = prior_cells(problem.width);
    planes[cell] = predicted_plane(problem, moments, cell % columns, cell / columns);
  }
}

/// The twin of the host's depth_map_of. `normals` has three floats a pixel.
__global__ void map_kernel(WorldFromCamera axes, const StereoPlane* planes, const float* costs,
                           float* depths, float* normals, float* confidences, int count) {
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (p >= count) {
    return;
  }
  const StereoPlane plane = planes[p];
  const bool known = plane.depth > 0;
  const Vec3f normal = known ? world_normal(axes, plane.normal) : Vec3f{0, 0, 0};
  depths[p] = known ? plane.depth : 0;
  normals[3 * p] = normal.x;
  normals[3 * p + 1] = normal.y;
  normals[3 * p + 2] = normal.z;
  confidences[p] = known ? confidence_of(costs[p]) : 0;
}

/// A view at one level on the device.
struct DeviceView {
  Camera camera;
  int width = 0;
  int height = 0;
  CudaBuffer<float> image, near_depth, far_depth, costs, depths;
  CudaBuffer<StereoPlane> planes;
  int pixels() const { return width * height; }
};

DeviceView device_view(const StereoLevels& levels, std::size_t level, std::size_t view) {
  DeviceView there;
  there.camera = levels.camera(view, level);
  const Image& image = levels.image(view, level);
  there.width = image.width;
  there.height = image.height;
  there.image = CudaBuffer<float>(image.data);
  there.near_depth = CudaBuffer<float>(levels.near_depth(view, level).data);
  there.far_depth = CudaBuffer<float>(levels.far_depth(view, level).data);
  there.costs = CudaBuffer<float>(image.data.size());
  there.depths = CudaBuffer<float>(image.data.size());
  there.planes = CudaBuffer<StereoPlane>(image.data.size());
  return there;
}

StereoProblem problem_of(const std::vector<DeviceView>& at, const std::vector<StereoView>& views,
                         const StereoOptions& options, std::size_t view, bool with_depths) {
  StereoProblem problem = stereo_problem(at[view].camera, options, stereo_seed(options, view));
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

constexpr int kThreads = 256;
unsigned blocks_of(int count) {
  return static_cast<unsigned>(blocks_for(count, kThreads));
}

/// Room for what the prior predicts of one view.
struct PriorRoom {
  CudaBuffer<PriorMoments> moments;
  CudaBuffer<Vec3f> planes;
};

/// Predictions for every cell of a view; they live in `room`.
const Vec3f* predict(const StereoProblem& problem, const DeviceView& view, PriorRoom& room) {
  const int cells = prior_cells(problem.width) * prior_cells(problem.height);
  if (room.planes.size() < static_cast<std::size_t>(cells)) {
    room.moments = CudaBuffer<PriorMoments>(static_cast<std::size_t>(cells));
    room.planes = CudaBuffer<Vec3f>(static_cast<std::size_t>(cells));
  }
  moments_kernel<<<blocks_of(cells), kThreads>>>(problem, view.planes.data(), view.costs.data(),
                                                 room.moments.data(), cells);
  ATELIER_CUDA_CHECK(cudaGetLastError());
  predict_kernel<<<blocks_of(cells), kThreads>>>(problem, room.moments.data(), room.planes.data(),
                                                 cells);
  ATELIER_CUDA_CHECK(cudaGetLastError());
  return room.planes.data();
}

void copy_to(const CudaBuffer<float>& from, std::vector<float>& to) {
  ATELIER_CUDA_CHECK(
      cudaMemcpy(to.data(), from.data(), to.size() * sizeof(float), cudaMemcpyDeviceToHost));
}

/// Maps of all views. The room on the host is taken by all threads at once: to touch it for the
/// first time costs more than the copy.
std::vector<DepthMap> download_maps(std::vector<DeviceView>& at) {
  std::vector<DepthMap> maps(at.size());
  parallel_for(static_cast<Index>(at.size()), 1, [&](Index begin, Index end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      DeviceView& view = at[i];
      maps[i] = empty_depth_map(view.camera);
      CudaBuffer<float> normals(3 * view.image.size());
      // Image and bounds are needed no more: two of them take depth and confidence.
      map_kernel<<<blocks_of(view.pixels()), kThreads>>>(
          world_from_camera(view.camera), view.planes.data(), view.costs.data(), view.depths.data(),
          normals.data(), view.near_depth.data(), view.pixels());
      ATELIER_CUDA_CHECK(cudaGetLastError());
      copy_to(view.depths, maps[i].depth.data);
      copy_to(normals, maps[i].normal.data);
      copy_to(view.near_depth, maps[i].confidence.data);
    }
  });
  return maps;
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

std::vector<DepthMap> stereo_cuda(const std::vector<StereoView>& views,
                                  const StereoOptions& options) {
  const StereoLevels levels = stereo_levels(views, options.levels);
  std::vector<DeviceView> coarser;
  PriorRoom prior;
  for (std::size_t down = 0; down <= levels.deepest; ++down) {
    const std::size_t level = levels.deepest - down;
    const bool coarsest = down == 0;
    std::vector<DeviceView> at;
    at.reserve(views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
      at.push_back(device_view(levels, level, i));
    }
    for (std::size_t i = 0; i < views.size(); ++i) {
      const StereoProblem problem = problem_of(at, views, options, i, false);
      const StereoProblem coarse =
          coarsest ? problem : problem_of(coarser, views, options, i, false);
      start_kernel<<<blocks_of(at[i].pixels()), kThreads>>>(
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
        depth_kernel<<<blocks_of(view.pixels()), kThreads>>>(view.planes.data(), view.depths.data(),
                                                             view.pixels());
        ATELIER_CUDA_CHECK(cudaGetLastError());
      }
      for (std::size_t i = 0; i < views.size(); ++i) {
        StereoProblem problem = problem_of(at, views, options, i, agreeing);
        if (uses_prior(options, refinement)) {
          problem.prior = predict(problem, at[i], prior);
        }
        sweep(problem, at[i], refinement_iteration(options, static_cast<int>(down), refinement));
      }
    }
    coarser = std::move(at);
  }
  return download_maps(coarser);
}

}  // namespace atelier
