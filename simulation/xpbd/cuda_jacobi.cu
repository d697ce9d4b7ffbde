#include "simulation/xpbd/cuda_jacobi.cuh"

namespace atelier {
namespace {

/// Data of the kernels of one scene.
template <class T>
struct JacobiView {
  const JacobiEdge<T>* edges;
  const JacobiTriangle<T>* triangles;
  const int* begin;
  const int* response_of;
  const EdgeRule<T>* rules;
  const StrainRest<T>* strains;
  int edge_count, triangle_count, particles;
  Vec4<T>* x;
  const Vec4<T>* start;
  Vec4<T>* x_before;
  Vec4<T>* push;
  EdgeMultipliers<T>* lambda;
  EdgeMultipliers<T>* lambda_before;
  T* strain_lambda;
  T* strain_before;
  SubstepScale<T> scale;
  T weight;
  bool first;  ///< iteration of the substep: nothing before

  __device__ JacobiStart<T> from() const { return {x, start, scale}; }
};

template <class T>
__global__ void jacobi_edge_kernel(JacobiView<T> j) {
  const int e = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (e >= j.edge_count) {
    return;
  }
  const EdgeMultipliers<T> now = j.first ? EdgeMultipliers<T>{T(0), T(0)} : j.lambda[e];
  const EdgeMultipliers<T> before = j.first ? now : j.lambda_before[e];
  const EdgeMultipliers<T> change =
      jacobi_edge(j.edges[e], j.rules[e], j.from(), now, j.push + 4 * e);
  j.lambda[e] = {accelerated(now.hinge, change.hinge, before.hinge, j.weight),
                 accelerated(now.spring, change.spring, before.spring, j.weight)};
  j.lambda_before[e] = now;
}

template <class T>
__global__ void jacobi_triangle_kernel(JacobiView<T> j) {
  const int t = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (t >= j.triangle_count) {
    return;
  }
  T now[3];
  T change[3];
  for (int c = 0; c < 3; ++c) {
    now[c] = j.first ? T(0) : j.strain_lambda[3 * t + c];
  }
  jacobi_triangle(j.triangles[t], j.strains[t], j.from(), now, change,
                  j.push + 4 * j.edge_count + 3 * t);
  for (int c = 0; c < 3; ++c) {
    const T before = j.first ? T(0) : j.strain_before[3 * t + c];
    j.strain_lambda[3 * t + c] = accelerated(now[c], change[c], before, j.weight);
    j.strain_before[3 * t + c] = now[c];
  }
}

template <class T>
__global__ void jacobi_particle_kernel(JacobiView<T> j) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= j.particles) {
    return;
  }
  const Vec4<T> now = j.x[i];
  const Vec4<T> before = j.first ? now : j.x_before[i];
  const int first = j.begin[i];
  j.x[i] =
      jacobi_particle(now, before, j.push, j.response_of + first, j.begin[i + 1] - first, j.weight);
  j.x_before[i] = now;
}

}  // namespace

template <class T>
CudaJacobi<T>::CudaJacobi(const PreparedCloth<T>& prepared, double radius, int scenes)
    : scenes_(scenes), radius_(static_cast<T>(radius)) {
  const JacobiPlan<T> plan = prepare_jacobi(prepared);
  edges_ = CudaBuffer<JacobiEdge<T>>(plan.edges);
  triangles_ = CudaBuffer<JacobiTriangle<T>>(plan.triangles);
  begin_ = CudaBuffer<int>(plan.begin);
  push_of_ = CudaBuffer<int>(plan.push);
  push_ = CudaBuffer<Vec4<T>>(4 * plan.edges.size() + 3 * plan.triangles.size());
  const std::size_t s = static_cast<std::size_t>(scenes);
  x_before_ = CudaBuffer<Vec4<T>>(s * static_cast<std::size_t>(prepared.count));
  lambda_before_ = CudaBuffer<EdgeMultipliers<T>>(s * plan.edges.size());
  strain_before_ = CudaBuffer<T>(3 * s * plan.triangles.size());
}

template <class T>
void CudaJacobi<T>::sweep(const CudaFrame<T>& frame, const std::vector<CudaSceneRule<T>>& rules,
                          int iteration) {
  weight_ = chebyshev_weight(iteration, weight_, radius_);
  for (int scene = 0; scene < scenes_; ++scene) {
    const std::int64_t s = scene;
    const CudaSceneRule<T>& rule = rules[static_cast<std::size_t>(scene)];
    JacobiView<T> j{};
    j.edges = edges_.data();
    j.triangles = triangles_.data();
    j.begin = begin_.data();
    j.response_of = push_of_.data();
    j.rules = frame.edge_rules;
    j.strains = frame.strains;
    j.edge_count = frame.edge_count;
    j.triangle_count = frame.strain_count;
    j.particles = frame.count;
    j.x = frame.x + s * frame.count;
    j.start = frame.start + s * frame.count;
    j.x_before = x_before_.data() + s * frame.count;
    j.push = push_.data();
    j.lambda = frame.lambda + s * frame.edge_count;
    j.lambda_before = lambda_before_.data() + s * frame.edge_count;
    j.strain_lambda = frame.strain_lambda + 3 * s * frame.strain_count;
    j.strain_before = strain_before_.data() + 3 * s * frame.strain_count;
    j.scale = substep_scale(frame.h, frame.damping, rule.spring_softness, rule.hinge_softness);
    j.weight = weight_;
    j.first = iteration == 0;
    if (j.edge_count > 0) {
      jacobi_edge_kernel<<<cuda_blocks(j.edge_count), kCudaBlock>>>(j);
      ATELIER_CUDA_LAUNCHED(jacobi_edge_kernel);
    }
    if (j.triangle_count > 0) {
      jacobi_triangle_kernel<<<cuda_blocks(j.triangle_count), kCudaBlock>>>(j);
      ATELIER_CUDA_LAUNCHED(jacobi_triangle_kernel);
    }
    jacobi_particle_kernel<<<cuda_blocks(j.particles), kCudaBlock>>>(j);
    ATELIER_CUDA_LAUNCHED(jacobi_particle_kernel);
  }
}

template class CudaJacobi<float>;
template class CudaJacobi<double>;

}  // namespace atelier
