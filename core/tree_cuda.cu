#include "core/tree_cuda.cuh"

namespace atelier {
namespace {

constexpr int kTopBlock = 1024;  // levels of up to so many nodes are refitted by one block together

template <class T>
__global__ void refit_level(TreeNode<T>* nodes, int begin, int end, const TreeFace* faces,
                            const Vec3<T>* vertices) {
  const int i = begin + static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < end) {
    refit_node(nodes, i, faces, vertices);
  }
}

/// Levels [0, levels), the deepest first, in one block.
template <class T>
__global__ void __launch_bounds__(kTopBlock)
    refit_top(TreeNode<T>* nodes, const int* level_begin, int levels, const TreeFace* faces,
              const Vec3<T>* vertices) {
  for (int level = levels - 1; level >= 0; --level) {
    const int i = level_begin[level] + static_cast<int>(threadIdx.x);
    if (i < level_begin[level + 1]) {
      refit_node(nodes, i, faces, vertices);
    }
    __syncthreads();
  }
}

template <class T>
__global__ void find_nearest(TreeView<T> tree, const Vec3<T>* queries, std::size_t n,
                             T max_squared_distance, TreePoint<T>* found) {
  const std::size_t i = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < n) {
    found[i] = nearest_in_tree(tree, queries[i], max_squared_distance);
  }
}

template <class T>
__global__ void find_hits(TreeView<T> tree, const TreeRay<T>* rays, std::size_t n, bool any,
                          TreeHit<T>* found) {
  const std::size_t i = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < n) {
    const TreeRay<T> ray = rays[i];
    found[i] = hit_in_tree(tree, ray.origin, ray.direction, ray.t_min, ray.t_max, any);
  }
}

template <class T>
std::vector<Vec3<T>> rounded(const std::vector<Vec3d>& vertices) {
  std::vector<Vec3<T>> copy;
  copy.reserve(vertices.size());
  for (const Vec3d& v : vertices) {
    copy.push_back({static_cast<T>(v.x), static_cast<T>(v.y), static_cast<T>(v.z)});
  }
  return copy;
}

template <class T>
std::vector<TreeNode<T>> shape_of(const std::vector<TreeNode<double>>& nodes) {
  std::vector<TreeNode<T>> copy;
  copy.reserve(nodes.size());
  for (const TreeNode<double>& node : nodes) {
    copy.push_back({{0, 0, 0}, {0, 0, 0}, node.first, node.count});
  }
  return copy;
}

}  // namespace

template <class T>
CudaTree<T>::CudaTree(const TriangleTree& tree)
    : nodes_(shape_of<T>(tree.nodes)),
      faces_(tree.faces),
      vertices_(rounded<T>(tree.vertices)),
      level_begin_on_device_(tree.level_begin),
      level_begin_(tree.level_begin) {
  refit_boxes();
}

template <class T>
void CudaTree<T>::refit(const Vec3<T>* vertices) {
  if (vertices_.size() > 0) {
    ATELIER_CUDA_CHECK(cudaMemcpyAsync(
        vertices_.data(), vertices, vertices_.size() * sizeof(Vec3<T>), cudaMemcpyDeviceToDevice));
  }
  refit_boxes();
}

template <class T>
void CudaTree<T>::refit_boxes() {
  if (nodes_.size() == 0) {
    return;
  }
  int level = static_cast<int>(level_begin_.size()) - 2;
  // The last level of up to kTopBlock nodes below which none is wider.
  int top_levels = 0;
  while (top_levels <= level &&
         level_begin_[top_levels + 1] - level_begin_[top_levels] <= kTopBlock) {
    ++top_levels;
  }
  for (; level >= top_levels; --level) {
    const int begin = level_begin_[level];
    const int end = level_begin_[level + 1];
    refit_level<<<cuda_blocks(end - begin), kCudaBlock>>>(nodes_.data(), begin, end, faces_.data(),
                                                          vertices_.data());
    ATELIER_CUDA_LAUNCHED(refit_level);
  }
  refit_top<<<1, kTopBlock>>>(nodes_.data(), level_begin_on_device_.data(), top_levels,
                              faces_.data(), vertices_.data());
  ATELIER_CUDA_LAUNCHED(refit_top);
}

template <class T>
CudaBuffer<TreePoint<T>> CudaTree<T>::nearest(const Vec3<T>* queries, std::size_t n,
                                              T max_squared_distance) const {
  CudaBuffer<TreePoint<T>> found(n);
  if (n > 0) {
    find_nearest<<<cuda_blocks(static_cast<std::ptrdiff_t>(n)), kCudaBlock>>>(
        view(), queries, n, max_squared_distance, found.data());
    ATELIER_CUDA_LAUNCHED(find_nearest);
  }
  return found;
}

template <class T>
CudaBuffer<TreeHit<T>> CudaTree<T>::hits(const TreeRay<T>* rays, std::size_t n, bool any) const {
  CudaBuffer<TreeHit<T>> found(n);
  if (n > 0) {
    find_hits<<<cuda_blocks(static_cast<std::ptrdiff_t>(n)), kCudaBlock>>>(view(), rays, n, any,
                                                                           found.data());
    ATELIER_CUDA_LAUNCHED(find_hits);
  }
  return found;
}

template class CudaTree<float>;
template class CudaTree<double>;

std::vector<TreePoint<double>> nearest_cuda(const TriangleTree& tree,
                                            const std::vector<Vec3d>& queries,
                                            double max_squared_distance) {
  const CudaBuffer<Vec3d> device_queries(queries);
  return CudaTree<double>(tree)
      .nearest(device_queries.data(), queries.size(), max_squared_distance)
      .download();
}

std::vector<TreeHit<double>> hits_cuda(const TriangleTree& tree,
                                       const std::vector<TreeRay<double>>& rays, bool any) {
  const CudaBuffer<TreeRay<double>> device_rays(rays);
  return CudaTree<double>(tree).hits(device_rays.data(), rays.size(), any).download();
}

}  // namespace atelier
