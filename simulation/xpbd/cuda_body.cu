#include <array>
#include <cub/device/device_radix_sort.cuh>

#include "simulation/xpbd/cuda_body.cuh"
#include "simulation/xpbd/cuda_boxes.cuh"
#include "simulation/xpbd/cuda_refit.cuh"
#include "simulation/xpbd/cuda_team.cuh"

namespace atelier {
namespace {

template <class T>
__global__ void key_kernel(BodyView<T> body, Box<T> bounds, std::uint64_t* keys) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f < body.face_count) {
    const Box<T> box = swept_box(body, f);
    keys[f] = tree_key(T(0.5) * (box.low + box.high), bounds, static_cast<std::uint32_t>(f));
  }
}

template <class T>
__global__ void children_kernel(const std::uint64_t* keys, int count, BoxNode<T>* nodes,
                                TreeParent* node_parent, TreeParent* leaf_parent) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i == 0) {
    node_parent[0] = -1;
  }
  if (count == 1) {
    if (i == 0) {
      nodes[0] = {{empty_box<T>(), empty_box<T>()}, {~0, ~0}};
      leaf_parent[0] = 0;
    }
    return;
  }
  if (i >= count - 1) {
    return;
  }
  const TreeChildren children = tree_children(keys, count, i);
  const int child[2] = {children.left, children.right};
  for (int side = 0; side < 2; ++side) {
    if (child[side] < 0) {
      const int primitive = static_cast<int>(keys[~child[side]] & 0xFFFFFFFFu);
      nodes[i].child[side] = ~primitive;
      leaf_parent[primitive] = 2 * i + side;
    } else {
      nodes[i].child[side] = child[side];
      node_parent[child[side]] = 2 * i + side;
    }
  }
}

template <class T>
__global__ void refit_kernel(BodyView<T> body, const int* keep, BoxNode<T>* nodes,
                             const TreeParent* node_parent, const TreeParent* leaf_parent,
                             unsigned* arrivals) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f < body.face_count) {
    const Box<T> box = keep == nullptr || keep[f] != 0 ? swept_box(body, f) : empty_box<T>();
    refit_from_box(box, f, nodes, node_parent, leaf_parent, arrivals);
  }
}

constexpr int kWhole = kGroup * kGroup;  ///< faces below a largest box, a block for each

template <class T>
__global__ void __launch_bounds__(kWhole)
    box_kernel(BodyView<T> body, const int* face, Box<T>* box, Box<T>* group, Box<T>* whole) {
  __shared__ unsigned char room[kGroup * sizeof(Box<T>)];
  Box<T>* const groups = reinterpret_cast<Box<T>*>(room);
  const int lane = static_cast<int>(threadIdx.x) % kGroup;
  const int warp = static_cast<int>(threadIdx.x) / kGroup;
  const int at = static_cast<int>(blockIdx.x) * kWhole + static_cast<int>(threadIdx.x);
  const Box<T> own = at < body.face_count ? swept_box(body, face[at]) : empty_box<T>();
  box[at] = own;
  const Box<T> all = united_in_warp(own);
  if (lane == 0) {
    group[at / kGroup] = all;
    groups[warp] = all;
  }
  __syncthreads();
  if (warp == 0) {
    const Box<T> largest = united_in_warp(groups[lane]);
    if (lane == 0) {
      whole[blockIdx.x] = largest;
    }
  }
}

/// So many fill the device only where each has a warp; of more, a thread each gets more done.
constexpr int kFewParticles = 200'000;
bool asks_boxes(int particles) {
  return particles <= kFewParticles;
}

/// Who asks the body for one particle: of few a warp, which goes through boxes; of many one thread,
/// which asks the tree, as its neighbours in the warp do for theirs.
template <bool kFew>
constexpr int kAskers = kFew ? 32 : 1;
template <bool kFew>
constexpr int kAskingThreads = kFew ? 64 : 128;  ///< of a block
template <bool kFew>
__device__ inline auto own_askers() {
  if constexpr (kFew) {
    namespace cg = cooperative_groups;
    __shared__ TeamRoom<32> rooms[kAskingThreads<kFew> / 32];
    const cg::thread_block_tile<32> tile = cg::tiled_partition<32>(cg::this_thread_block());
    return TeamInBody<32, true>{tile, rooms[tile.meta_group_rank()]};
  } else {
    return AloneInTree{};
  }
}
/// The particle of this thread.
template <bool kFew>
__device__ inline int own_particle() {
  return static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / kAskers<kFew>);
}
template <bool kFew>
__device__ inline bool speaks_for_particle() {
  return threadIdx.x % kAskers<kFew> == 0;
}

template <bool kFew, class Kernel, class... Arguments>
void launch_askers(int particles, Kernel kernel, const Arguments&... arguments) {
  constexpr int kThreads = kAskingThreads<kFew>;
  kernel<<<cuda_blocks(particles, kThreads / kAskers<kFew>), kThreads>>>(arguments...);
  ATELIER_CUDA_LAUNCHED(kernel);
}

template <class T, bool kFew>
__global__ void __launch_bounds__(kAskingThreads<kFew>)
    candidate_kernel(BodyView<T> body, BodyContactRule<T> rule, FrameParticles<T> particles,
                     FrameForces<T> forces, BodyOutlook<T>* outlook, int* candidates) {
  const int i = own_particle<kFew>();
  if (i >= particles.count) {
    return;
  }
  Vec3<T> acceleration = forces.gravity;
  if (forces.air != nullptr) {
    acceleration += xyz(forces.air[i]);
  }
  const T slack = expected_deviation(acceleration, particles.time);
  const BodyOutlook<T> found =
      particles.x[i].w > T(0)
          ? collect_candidates(body, particles.flight(i), slack, rule,
                               candidates + static_cast<std::int64_t>(i) * kBodyCandidates,
                               own_askers<kFew>())
          : BodyOutlook<T>{slack, T(0), T(0), {}, 0};
  if (speaks_for_particle<kFew>()) {
    outlook[i] = found;
  }
}

template <class T>
__global__ void depth_kernel(BodyView<T> body, T reach, int particles, const Vec4<T>* x, T* depth) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < particles) {
    depth[i] = x[i].w > T(0) ? depth_inside(body, xyz(x[i]), reach) : T(0);
  }
}

template <class T, bool kFew>
__global__ void __launch_bounds__(kAskingThreads<kFew>)
    end_outside_kernel(BodyView<T> body, BodyContactRule<T> rule, FrameParticles<T> particles,
                       const BodyOutlook<T>* outlook, int substeps, Vec4<T>* x) {
  const int i = own_particle<kFew>();
  if (i >= particles.count) {
    return;
  }
  Vec4<T> end = x[i];
  if (end.w > T(0)) {
    end_outside(body, rule, outlook[i], particles.flight(i), substeps, end, own_askers<kFew>());
  }
  if constexpr (kFew) {
    __syncwarp();  // all have read it
  }
  if (speaks_for_particle<kFew>()) {
    x[i] = end;
  }
}

}  // namespace

SideStream::SideStream() {
  ATELIER_CUDA_CHECK(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking));
  for (cudaEvent_t* event : {&forked_, &done_}) {
    ATELIER_CUDA_CHECK(cudaEventCreateWithFlags(event, cudaEventDisableTiming));
  }
}

SideStream::~SideStream() {
  static_cast<void>(cudaEventDestroy(forked_));
  static_cast<void>(cudaEventDestroy(done_));
  static_cast<void>(cudaStreamDestroy(stream_));
}

cudaStream_t SideStream::fork() {
  ATELIER_CUDA_CHECK(cudaEventRecord(forked_));
  ATELIER_CUDA_CHECK(cudaStreamWaitEvent(stream_, forked_));
  return stream_;
}

void SideStream::join() {
  ATELIER_CUDA_CHECK(cudaEventRecord(done_, stream_));
  ATELIER_CUDA_CHECK(cudaStreamWaitEvent(cudaStreamLegacy, done_));
}

template <class T>
CudaBody<T>::CudaBody(const Triangles& faces) : face_count_(static_cast<int>(faces.rows())) {
  for (Index f = 0; f < faces.rows(); ++f) {
    host_faces_.push_back({faces(f, 0), faces(f, 1), faces(f, 2)});
  }
  faces_ = CudaBuffer<FaceIndices>(host_faces_);
}

template <class T>
BodyView<T> CudaBody<T>::view() const {
  return {faces_.data(),
          start_.data(),
          end_.data(),
          nodes_.data(),
          face_count_,
          {ordered_.data(), box_.data(), group_.data(), whole_.data(),
           static_cast<int>(whole_.size())}};
}

template <class T>
void CudaBody<T>::move(const Points& start, const Points& end) {
  const auto upload = [&](const Points& from, CudaBuffer<Vec4<T>>& to) {
    const std::size_t n = static_cast<std::size_t>(from.rows());
    staging_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto row = from.row(static_cast<Index>(i));
      staging_[i] = {static_cast<T>(row[0]), static_cast<T>(row[1]), static_cast<T>(row[2]), T(0)};
    }
    if (to.size() != n) {
      to = CudaBuffer<Vec4<T>>(n);
    }
    to.upload(staging_);
  };
  upload(start, start_);
  upload(end, end_);
  if (!built_) {
    Box<T> bounds = empty_box<T>();
    for (const Points* p : {&start, &end}) {
      for (Index i = 0; i < p->rows(); ++i) {
        grow(bounds, Vec3<T>{static_cast<T>((*p)(i, 0)), static_cast<T>((*p)(i, 1)),
                             static_cast<T>((*p)(i, 2))});
      }
    }
    build(bounds);
    order_boxes(start);
    built_ = true;
  }
}

template <class T>
void CudaBody<T>::build(const Box<T>& bounds) {
  const std::size_t n = static_cast<std::size_t>(face_count_);
  const std::size_t inner = n > 1 ? n - 1 : 1;
  nodes_ = CudaBuffer<BoxNode<T>>(inner);
  nodes_.clear();  // other trees are copied from it before its boxes are fitted
  node_parent_ = CudaBuffer<TreeParent>(inner);
  leaf_parent_ = CudaBuffer<TreeParent>(n);
  arrivals_ = CudaBuffer<unsigned>(inner);
  arrivals_.clear();
  CudaBuffer<std::uint64_t> keys(n);
  CudaBuffer<std::uint64_t> sorted(n);
  BodyView<T> body = view();
  key_kernel<<<cuda_blocks(face_count_), kCudaBlock>>>(body, bounds, keys.data());
  ATELIER_CUDA_LAUNCHED(key_kernel);
  std::size_t bytes = 0;
  ATELIER_CUDA_CHECK(
      cub::DeviceRadixSort::SortKeys(nullptr, bytes, keys.data(), sorted.data(), face_count_));
  CudaBuffer<unsigned char> scratch(bytes);
  ATELIER_CUDA_CHECK(cub::DeviceRadixSort::SortKeys(scratch.data(), bytes, keys.data(),
                                                    sorted.data(), face_count_));
  children_kernel<<<cuda_blocks(face_count_), kCudaBlock>>>(
      sorted.data(), face_count_, nodes_.data(), node_parent_.data(), leaf_parent_.data());
  ATELIER_CUDA_LAUNCHED(children_kernel);
  ATELIER_CUDA_CHECK(cudaDeviceSynchronize());  // the keys live until here
}

template <class T>
void CudaBody<T>::order_boxes(const Points& vertices) {
  std::vector<std::array<double, 3>> centres;
  centres.reserve(host_faces_.size());
  for (const FaceIndices& f : host_faces_) {
    const Eigen::RowVector3d sum = vertices.row(f.a) + vertices.row(f.b) + vertices.row(f.c);
    centres.push_back({sum.x(), sum.y(), sum.z()});
  }
  std::vector<int> order = near_group_order(centres);
  const std::size_t wholes = (centres.size() + kWhole - 1) / kWhole;
  // The boxes behind the last face are empty, but what flies without end meets them too: it finds
  // that face again.
  order.resize(wholes * kWhole, order.empty() ? 0 : order.back());
  ordered_ = CudaBuffer<int>(order);
  box_ = CudaBuffer<Box<T>>(wholes * kWhole);
  group_ = CudaBuffer<Box<T>>(wholes * kGroup);
  whole_ = CudaBuffer<Box<T>>(wholes);
}

template <class T>
void CudaBody<T>::refit_nodes(const int* keep, BoxNode<T>* nodes, cudaStream_t stream) {
  refit_kernel<<<cuda_blocks(face_count_), kCudaBlock, 0, stream>>>(
      view(), keep, nodes, node_parent_.data(), leaf_parent_.data(), arrivals_.data());
  ATELIER_CUDA_LAUNCHED(refit_kernel);
}

template <class T>
void CudaBody<T>::refit_where(const int* keep, CudaBuffer<BoxNode<T>>& nodes) {
  if (nodes.size() != nodes_.size()) {
    nodes = CudaBuffer<BoxNode<T>>(nodes_.size());
    ATELIER_CUDA_CHECK(cudaMemcpy(nodes.data(), nodes_.data(), nodes_.size() * sizeof(BoxNode<T>),
                                  cudaMemcpyDeviceToDevice));
  }
  refit_nodes(keep, nodes.data(), cudaStreamLegacy);
}

template <class T>
void CudaBody<T>::refit(int particles) {
  refit_nodes(nullptr, nodes_.data(), beside_.fork());
  if (!asks_boxes(particles)) {
    wait_for_tree();
  }
  box_kernel<<<static_cast<unsigned>(whole_.size()), kWhole>>>(view(), ordered_.data(), box_.data(),
                                                               group_.data(), whole_.data());
  ATELIER_CUDA_LAUNCHED(box_kernel);
}

template <class T>
void launch_candidates(const BodyView<T>& body, const BodyContactRule<T>& rule,
                       const FrameParticles<T>& particles, const FrameForces<T>& forces,
                       BodyOutlook<T>* outlook, int* candidates) {
  if (asks_boxes(particles.count)) {
    launch_askers<true>(particles.count, candidate_kernel<T, true>, body, rule, particles, forces,
                        outlook, candidates);
  } else {
    launch_askers<false>(particles.count, candidate_kernel<T, false>, body, rule, particles, forces,
                         outlook, candidates);
  }
}

template <class T>
void launch_depths(const BodyView<T>& body, T reach, int particles, const Vec4<T>* x, T* depth) {
  depth_kernel<<<cuda_blocks(particles, 64), 64>>>(body, reach, particles, x, depth);
  ATELIER_CUDA_LAUNCHED(depth_kernel);
}

template <class T>
void launch_end_outside(const BodyView<T>& body, const BodyContactRule<T>& rule,
                        const FrameParticles<T>& particles, const BodyOutlook<T>* outlook,
                        int substeps, Vec4<T>* x) {
  if (asks_boxes(particles.count)) {
    launch_askers<true>(particles.count, end_outside_kernel<T, true>, body, rule, particles,
                        outlook, substeps, x);
  } else {
    launch_askers<false>(particles.count, end_outside_kernel<T, false>, body, rule, particles,
                         outlook, substeps, x);
  }
}

template class CudaBody<float>;
template class CudaBody<double>;
template void launch_candidates(const BodyView<float>&, const BodyContactRule<float>&,
                                const FrameParticles<float>&, const FrameForces<float>&,
                                BodyOutlook<float>*, int*);
template void launch_candidates(const BodyView<double>&, const BodyContactRule<double>&,
                                const FrameParticles<double>&, const FrameForces<double>&,
                                BodyOutlook<double>*, int*);
template void launch_depths(const BodyView<float>&, float, int, const Vec4<float>*, float*);
template void launch_depths(const BodyView<double>&, double, int, const Vec4<double>*, double*);
template void launch_end_outside(const BodyView<float>&, const BodyContactRule<float>&,
                                 const FrameParticles<float>&, const BodyOutlook<float>*, int,
                                 Vec4<float>*);
template void launch_end_outside(const BodyView<double>&, const BodyContactRule<double>&,
                                 const FrameParticles<double>&, const BodyOutlook<double>*, int,
                                 Vec4<double>*);

}  // namespace atelier
