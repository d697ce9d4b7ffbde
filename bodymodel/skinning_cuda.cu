#include "bodymodel/skinning_device.h"
#include "core/cuda_buffer.cuh"

namespace atelier {
namespace {

__global__ void linear_kernel(int count, int slots, const Vec3d* rest, const int* joints,
                              const double* weights, const SkinTransform* transforms,
                              Vec3d* skinned) {
  const int v = blockIdx.x * blockDim.x + threadIdx.x;
  if (v < count) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(v) * slots;
    skinned[v] = skin_linear(transforms, joints + row, weights + row, slots, rest[v]);
  }
}

__global__ void dual_quaternion_kernel(int count, int slots, const Vec3d* rest, const int* joints,
                                       const double* weights, const DualQuaternion* transforms,
                                       Vec3d* skinned) {
  const int v = blockIdx.x * blockDim.x + threadIdx.x;
  if (v < count) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(v) * slots;
    skinned[v] = skin_dual_quaternion(transforms, joints + row, weights + row, slots, rest[v]);
  }
}

// Points and Vec3d have the same layout: three doubles a row.
static_assert(sizeof(Vec3d) == 3 * sizeof(double));

template <class Transform, class Launch>
Points skin(const Points& rest, const SkinWeights& weights,
            const std::vector<Transform>& transforms, const Launch& launch) {
  Points skinned(rest.rows(), 3);
  if (rest.rows() == 0) {
    return skinned;
  }
  const std::size_t count = static_cast<std::size_t>(rest.rows());
  const std::size_t entries = static_cast<std::size_t>(weights.weights.size());
  const CudaBuffer<Vec3d> from(reinterpret_cast<const Vec3d*>(rest.data()), count);
  const CudaBuffer<int> joints(weights.joints.data(), entries);
  const CudaBuffer<double> shares(weights.weights.data(), entries);
  const CudaBuffer<Transform> moves(transforms);
  CudaBuffer<Vec3d> to(count);
  launch(static_cast<int>(count), static_cast<int>(weights.weights.cols()), from.data(),
         joints.data(), shares.data(), moves.data(), to.data());
  const std::vector<Vec3d> result = to.download();
  for (std::size_t v = 0; v < count; ++v) {
    skinned.row(static_cast<Index>(v)) << result[v].x, result[v].y, result[v].z;
  }
  return skinned;
}

}  // namespace

Points skin_linear_cuda(const Points& rest, const SkinWeights& weights,
                        const std::vector<SkinTransform>& transforms) {
  return skin(rest, weights, transforms,
              [](int count, int slots, const Vec3d* from, const int* joints, const double* shares,
                 const SkinTransform* moves, Vec3d* to) {
                linear_kernel<<<cuda_blocks(count), kCudaBlock>>>(count, slots, from, joints,
                                                                  shares, moves, to);
                ATELIER_CUDA_LAUNCHED(linear_kernel);
              });
}

Points skin_dual_quaternion_cuda(const Points& rest, const SkinWeights& weights,
                                 const std::vector<DualQuaternion>& transforms) {
  return skin(rest, weights, transforms,
              [](int count, int slots, const Vec3d* from, const int* joints, const double* shares,
                 const DualQuaternion* moves, Vec3d* to) {
                dual_quaternion_kernel<<<cuda_blocks(count), kCudaBlock>>>(
                    count, slots, from, joints, shares, moves, to);
                ATELIER_CUDA_LAUNCHED(dual_quaternion_kernel);
              });
}

double linear_kernel_seconds(const Points& rest, const SkinWeights& weights,
                             const std::vector<SkinTransform>& transforms, int repeats) {
  cudaEvent_t start = nullptr;
  cudaEvent_t stop = nullptr;
  ATELIER_CUDA_CHECK(cudaEventCreate(&start));
  ATELIER_CUDA_CHECK(cudaEventCreate(&stop));
  float milliseconds = 0;
  skin(rest, weights, transforms,
       [&](int count, int slots, const Vec3d* from, const int* joints, const double* shares,
           const SkinTransform* moves, Vec3d* to) {
         for (int i = 0; i < 2 * repeats; ++i) {
           if (i == repeats) {
             ATELIER_CUDA_CHECK(cudaEventRecord(start));
           }
           linear_kernel<<<cuda_blocks(count), kCudaBlock>>>(count, slots, from, joints, shares,
                                                             moves, to);
           ATELIER_CUDA_LAUNCHED(linear_kernel);
         }
         ATELIER_CUDA_CHECK(cudaEventRecord(stop));
         ATELIER_CUDA_CHECK(cudaEventSynchronize(stop));
         ATELIER_CUDA_CHECK(cudaEventElapsedTime(&milliseconds, start, stop));
       });
  ATELIER_CUDA_CHECK(cudaEventDestroy(start));
  ATELIER_CUDA_CHECK(cudaEventDestroy(stop));
  return 1e-3 * milliseconds / repeats;
}

}  // namespace atelier
