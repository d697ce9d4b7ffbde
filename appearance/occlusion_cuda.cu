#include "appearance/occlusion_cuda.cuh"
#include "core/cuda_buffer.cuh"
#include "core/tree_cuda.cuh"

namespace atelier {
namespace {

/// One thread for each vertex, side and row of strata.
__global__ void count_open(TreeView<double> tree, const Vec3d* positions, const Vec3d* normals,
                           int vertices, AmbientRays rays, int* open) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= 2 * vertices * rays.strata) {
    return;
  }
  const int row = i % rays.strata;
  const int side = i / rays.strata;  // 2 * vertex + (0 outside, 1 inside)
  const Vec3d normal = side % 2 == 0 ? normals[side / 2] : -normals[side / 2];
  atomicAdd(&open[side], open_rays(tree, positions[side / 2], normal,
                                   static_cast<std::uint64_t>(side / 2), row, rays));
}

}  // namespace

void open_rays_on_device(const TreeView<double>& tree, const Vec3d* positions, const Vec3d* normals,
                         int vertices, const AmbientRays& rays, int* open) {
  if (vertices == 0) {
    return;
  }
  ATELIER_CUDA_CHECK(
      cudaMemsetAsync(open, 0, 2 * static_cast<std::size_t>(vertices) * sizeof(int)));
  count_open<<<cuda_blocks(2 * vertices * rays.strata), kCudaBlock>>>(tree, positions, normals,
                                                                      vertices, rays, open);
  ATELIER_CUDA_LAUNCHED(count_open);
}

std::vector<int> open_rays_cuda(const TriangleTree& tree, const std::vector<Vec3d>& positions,
                                const std::vector<Vec3d>& normals, const AmbientRays& rays) {
  const CudaTree<double> on_device(tree);
  const CudaBuffer<Vec3d> at(positions);
  const CudaBuffer<Vec3d> along(normals);
  CudaBuffer<int> open(2 * positions.size());
  open_rays_on_device(on_device.view(), at.data(), along.data(), static_cast<int>(positions.size()),
                      rays, open.data());
  return open.download();
}

}  // namespace atelier
