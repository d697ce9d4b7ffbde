#include "core/cuda_buffer.cuh"
#include "core/winding_cuda.h"

namespace atelier {
namespace {

__global__ void sum_windings(WindingView<double> view, const Vec3d* queries, std::size_t n,
                             double accuracy, double* numbers) {
  const std::size_t i = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < n) {
    numbers[i] = winding_in_tree(view, queries[i], accuracy);
  }
}

}  // namespace

std::vector<double> winding_cuda(const WindingTree& tree, const std::vector<Vec3d>& queries,
                                 double accuracy) {
  if (queries.empty()) {
    return {};
  }
  const CudaBuffer<TreeNode<double>> nodes(tree.tree.nodes);
  const CudaBuffer<TreeFace> faces(tree.tree.faces);
  const CudaBuffer<Vec3d> vertices(tree.tree.vertices);
  const CudaBuffer<WindingMoments<double>> moments(tree.moments);
  const CudaBuffer<Vec3d> area_normals(tree.area_normals);
  const CudaBuffer<Vec3d> device_queries(queries);
  CudaBuffer<double> numbers(queries.size());
  const WindingView<double> view = {
      {nodes.data(), faces.data(), vertices.data(), static_cast<int>(nodes.size())},
      moments.data(),
      area_normals.data()};
  sum_windings<<<cuda_blocks(static_cast<std::ptrdiff_t>(queries.size())), kCudaBlock>>>(
      view, device_queries.data(), queries.size(), accuracy, numbers.data());
  ATELIER_CUDA_LAUNCHED(sum_windings);
  return numbers.download();
}

}  // namespace atelier
