#include "appearance/occlusion_cuda.cuh"
#include "core/cuda_buffer.cuh"
#include "core/tree_cuda.cuh"

namespace atelier {
namespace {

/// One thread for each vertex, side and row of strata.
__global__ void sum_open(TreeView<double> tree, const Vec3d* positions, const Vec3d* normals,
                         int vertices, AmbientRays rays, OpenRays* open) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= 2 * vertices * rays.strata) {
    return;
  }
  const int row = i % rays.strata;
  const int side = i / rays.strata;  // 2 * vertex + (0 outside, 1 inside)
  const Vec3d normal = side % 2 == 0 ? normals[side / 2] : -normals[side / 2];
  const OpenRays of_row =
      open_rays(tree, positions[side / 2], normal, static_cast<std::uint64_t>(side / 2), row, rays);
  for (int k = 0; k < kTransferTerms; ++k) {
    // Two's complement: the sum of what is below 0, too.
    atomicAdd(reinterpret_cast<unsigned long long*>(&open[side].terms[k]),
              static_cast<unsigned long long>(of_row.terms[k]));
  }
}

}  // namespace

void open_rays_on_device(const TreeView<double>& tree, const Vec3d* positions, const Vec3d* normals,
                         int vertices, const AmbientRays& rays, OpenRays* open) {
  if (vertices == 0) {
    return;
  }
  ATELIER_CUDA_CHECK(
      cudaMemsetAsync(open, 0, 2 * static_cast<std::size_t>(vertices) * sizeof(OpenRays)));
  sum_open<<<cuda_blocks(2 * vertices * rays.strata), kCudaBlock>>>(tree, positions, normals,
                                                                    vertices, rays, open);
  ATELIER_CUDA_LAUNCHED(sum_open);
}

std::vector<OpenRays> open_rays_cuda(const TriangleTree& tree, const std::vector<Vec3d>& positions,
                                     const std::vector<Vec3d>& normals, const AmbientRays& rays) {
  const CudaTree<double> on_device(tree);
  const CudaBuffer<Vec3d> at(positions);
  const CudaBuffer<Vec3d> along(normals);
  CudaBuffer<OpenRays> open(2 * positions.size());
  open_rays_on_device(on_device.view(), at.data(), along.data(), static_cast<int>(positions.size()),
                      rays, open.data());
  return open.download();
}

}  // namespace atelier
