#include "simulation/cuda_refit.cuh"
#include "simulation/cuda_self.cuh"

namespace atelier {
namespace {

template <class T>
__global__ void flight_kernel(int particles, const Vec4<T>* x, const Vec4<T>* velocity, T frame,
                              Vec4<T>* start, Vec4<T>* end, int* tangled) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < particles) {
    start[i] = x[i];
    end[i] = with_w(xyz(x[i]) + frame * xyz(velocity[i]), x[i].w);
    tangled[i] = 0;
  }
}

/// The views of all scenes: the same surface, other particles.
template <class T>
struct SceneViews {
  SelfView<T> first;
  BoxNode<T>* nodes;
  int particles, inner;

  __device__ SelfView<T> of(int scene) const {
    SelfView<T> view = first;
    const std::int64_t s = scene;
    view.surface.start += s * particles;
    view.surface.end += s * particles;
    view.surface.nodes = nodes + s * inner;
    view.tangled += s * particles;
    return view;
  }
};

template <class T>
__global__ void self_refit_kernel(SceneViews<T> views, const TreeParent* node_parent,
                                  const TreeParent* leaf_parent, unsigned* arrivals) {
  const int scene = static_cast<int>(blockIdx.y);
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const SelfView<T> view = views.of(scene);
  if (f < view.surface.face_count) {
    refit_from_face(view.surface, f, views.nodes + static_cast<std::int64_t>(scene) * views.inner,
                    node_parent, leaf_parent,
                    arrivals + static_cast<std::int64_t>(scene) * views.inner);
  }
}

template <class T>
__global__ void face_pair_kernel(SceneViews<T> views, SelfRule<T> rule, int* count,
                                 SelfPair<T>* pairs, int* counts) {
  const int scene = static_cast<int>(blockIdx.y);
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= views.particles) {
    return;
  }
  const std::int64_t at = static_cast<std::int64_t>(scene) * views.particles + i;
  const SelfPairs<T> found = collect_faces(views.of(scene), i, rule);
  count[at] = found.count;
  for (int k = 0; k < found.count; ++k) {
    pairs[at * kSelfCandidates + k] = found.pair[k];
  }
  if (found.found > 0) {
    atomicAdd(&counts[4 * scene + 1], found.count);
    atomicAdd(&counts[4 * scene + 2], found.found - found.count);
  }
}

template <class T>
__global__ void edge_pair_kernel(SceneViews<T> views, SelfRule<T> rule, int* tangled, int2* count,
                                 SelfPair<T>* pairs, int* crossings, int* counts) {
  const int scene = static_cast<int>(blockIdx.y);
  const int e = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const SelfView<T> view = views.of(scene);
  if (e >= view.edge_count) {
    return;
  }
  const std::int64_t at = static_cast<std::int64_t>(scene) * view.edge_count + e;
  const EdgePairs<T> found = collect_edges(view, e, rule);
  count[at] = make_int2(found.edges.count, found.crossing_count);
  for (int k = 0; k < found.edges.count; ++k) {
    pairs[at * kSelfCandidates + k] = found.edges.pair[k];
  }
  int* const own = tangled + static_cast<std::int64_t>(scene) * views.particles;
  for (int k = 0; k < found.crossing_count; ++k) {
    crossings[at * kSelfCrossings + k] = found.crossing[k];
    const FaceIndices f = view.surface.faces[found.crossing[k]];
    const ClothEdge edge = view.edges[e];
    // Every writer writes the same.
    atomicExch(&own[edge.a], 1);
    atomicExch(&own[edge.b], 1);
    atomicExch(&own[f.a], 1);
    atomicExch(&own[f.b], 1);
    atomicExch(&own[f.c], 1);
  }
  if (found.edges.found > 0) {
    atomicAdd(&counts[4 * scene + 1], found.edges.count);
    atomicAdd(&counts[4 * scene + 2], found.edges.found - found.edges.count);
  }
}

}  // namespace

template <class T>
CudaSelf<T>::CudaSelf(const Cloth& cloth, const PreparedCloth<T>& prepared,
                      const XpbdOptions& options, int scenes)
    : scenes_(scenes), particles_(prepared.count), rule_(self_rule<T>(cloth, options)) {
  const PreparedSurface<T> surface = prepare_surface(cloth, prepared);
  face_count_ = static_cast<int>(surface.faces.size());
  edge_count_ = static_cast<int>(surface.edges.size());
  faces_ = CudaBuffer<FaceIndices>(surface.faces);
  edges_ = CudaBuffer<ClothEdge>(surface.edges);
  face_edges_ = CudaBuffer<int>(surface.face_edges);
  rest_ = CudaBuffer<Vec4<T>>(surface.rest);
  layer_ = CudaBuffer<int>(surface.layer);
  const std::size_t s = static_cast<std::size_t>(scenes);
  std::vector<BoxNode<T>> nodes;
  for (std::size_t k = 0; k < s; ++k) {
    nodes.insert(nodes.end(), surface.tree.nodes.begin(), surface.tree.nodes.end());
  }
  nodes_ = CudaBuffer<BoxNode<T>>(nodes);
  node_parent_ = CudaBuffer<TreeParent>(surface.tree.node_parent);
  leaf_parent_ = CudaBuffer<TreeParent>(surface.tree.leaf_parent);
  arrivals_ = CudaBuffer<unsigned>(nodes.size());
  const std::size_t n = s * static_cast<std::size_t>(particles_);
  const std::size_t e = s * static_cast<std::size_t>(edge_count_);
  start_ = CudaBuffer<Vec4<T>>(n);
  end_ = CudaBuffer<Vec4<T>>(n);
  tangled_ = CudaBuffer<int>(n);
  sums_ = CudaBuffer<PushSum>(n);
  sums_.clear();
  face_pair_count_ = CudaBuffer<int>(n);
  face_pairs_ = CudaBuffer<SelfPair<T>>(n * kSelfCandidates);
  edge_pair_count_ = CudaBuffer<int2>(e);
  edge_pairs_ = CudaBuffer<SelfPair<T>>(e * kSelfCandidates);
  crossings_ = CudaBuffer<int>(e * kSelfCrossings);
  counts_ = CudaBuffer<int>(4 * s);
}

template <class T>
SelfView<T> CudaSelf<T>::view(int scene) const {
  const std::size_t s = static_cast<std::size_t>(scene);
  const std::size_t n = s * static_cast<std::size_t>(particles_);
  const std::size_t inner = nodes_.size() / static_cast<std::size_t>(scenes_);
  return {
      {faces_.data(), start_.data() + n, end_.data() + n, nodes_.data() + s * inner, face_count_},
      edges_.data(),
      edge_count_,
      face_edges_.data(),
      rest_.data(),
      layer_.data(),
      tangled_.data() + n};
}

template <class T>
void CudaSelf<T>::collect(const Vec4<T>* x, const Vec4<T>* velocity, T frame) {
  const int all = particles_ * scenes_;
  flight_kernel<<<cuda_blocks(all), kCudaBlock>>>(all, x, velocity, frame, start_.data(),
                                                  end_.data(), tangled_.data());
  ATELIER_CUDA_LAUNCHED(flight_kernel);
  ATELIER_CUDA_CHECK(cudaMemsetAsync(arrivals_.data(), 0, arrivals_.size() * sizeof(unsigned)));
  ATELIER_CUDA_CHECK(cudaMemsetAsync(counts_.data(), 0, counts_.size() * sizeof(int)));
  const int inner = static_cast<int>(nodes_.size()) / scenes_;
  const SceneViews<T> views{view(0), nodes_.data(), particles_, inner};
  const unsigned scenes = static_cast<unsigned>(scenes_);
  self_refit_kernel<<<dim3(cuda_blocks(face_count_), scenes), kCudaBlock>>>(
      views, node_parent_.data(), leaf_parent_.data(), arrivals_.data());
  ATELIER_CUDA_LAUNCHED(self_refit_kernel);
  constexpr int kBlock = 64;
  face_pair_kernel<<<dim3(cuda_blocks(particles_, kBlock), scenes), kBlock>>>(
      views, rule_, face_pair_count_.data(), face_pairs_.data(), counts_.data());
  ATELIER_CUDA_LAUNCHED(face_pair_kernel);
  edge_pair_kernel<<<dim3(cuda_blocks(edge_count_, kBlock), scenes), kBlock>>>(
      views, rule_, tangled_.data(), edge_pair_count_.data(), edge_pairs_.data(), crossings_.data(),
      counts_.data());
  ATELIER_CUDA_LAUNCHED(edge_pair_kernel);
}

template <class T>
void CudaSelf<T>::describe(CudaFrame<T>& frame) {
  frame.self = view(0);
  frame.self_rule = rule_;
  frame.sums = sums_.data();
  frame.face_pair_count = face_pair_count_.data();
  frame.face_pairs = face_pairs_.data();
  frame.edge_pair_count = edge_pair_count_.data();
  frame.edge_pairs = edge_pairs_.data();
  frame.crossings = crossings_.data();
  frame.self_counts = counts_.data();
}

template <class T>
void CudaSelf<T>::count(std::vector<FrameReport>& reports) const {
  const std::vector<int> counts = counts_.download();
  for (int scene = 0; scene < scenes_; ++scene) {
    FrameReport& report = reports[static_cast<std::size_t>(scene)];
    report.self_contacts = counts[static_cast<std::size_t>(4 * scene)];
    report.self_candidates = counts[static_cast<std::size_t>(4 * scene + 1)];
    report.lost_candidates = counts[static_cast<std::size_t>(4 * scene + 2)];
  }
}

template class CudaSelf<float>;
template class CudaSelf<double>;

}  // namespace atelier
