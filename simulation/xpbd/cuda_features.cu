#include <algorithm>

#include "simulation/xpbd/cuda_features.cuh"

namespace atelier {
namespace {

template <class T>
__global__ void min_kernel(BodyView<T> body, const ClothEdge* edges, int count, T thickness,
                           T* least) {
  const int e = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (e < count) {
    least[e] = min_length_over(body, edges[e], thickness);
  }
}

template <class T>
__global__ void sharp_kernel(BodyFeatures<T> features, int count, const T* min_edge, T longest,
                             int* sharp, T* least, int* any) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f >= count) {
    return;
  }
  const SharpOfFace<T> found = sharp_of_face(features, f, min_edge, longest);
  sharp[f] = found.bits;
  least[f] = found.least;
  if (found.bits != 0) {
    *any = 1;  // every writer writes the same
  }
}

template <class T>
__global__ void near_kernel(CudaFeatureFrame<T> f, int particles, int scenes, T frame,
                            const Vec4<T>* x, const Vec4<T>* velocity,
                            const BodyOutlook<T>* outlook) {
  const std::int64_t at = static_cast<std::int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (at >= static_cast<std::int64_t>(scenes) * f.face_count) {
    return;
  }
  const int face = static_cast<int>(at % f.face_count);
  const int scene = static_cast<int>(at / f.face_count);
  const int offset = scene * particles;
  int near = 0;
  if (*f.any != 0) {
    const FaceIndices v = f.cloth.surface.faces[face];
    Box<T> box = empty_box<T>();
    T slack = T(0);
    for (int k : {v.a, v.b, v.c}) {
      const int i = offset + k;
      grow(box, xyz(x[i]));
      grow(box, xyz(x[i]) + frame * xyz(velocity[i]));
      slack = max_of(slack, outlook[i].slack);
    }
    visit_tree(f.features.nodes, inflated(box, slack + f.rule.within), [&](int body_face) {
      near |= f.length[face] >= f.features.least[body_face] ? 1 : 0;
    });
  }
  f.near[at] = near;
  if (near != 0) {
    f.near_faces[at - face + atomicAdd(f.near_count + scene, 1)] = face;
  }
}

}  // namespace

template <class T>
CudaFeatures<T>::CudaFeatures(const Cloth& cloth, const PreparedCloth<T>& prepared,
                              const std::vector<FaceIndices>& body_faces, int scenes)
    : face_count_(static_cast<int>(cloth.faces.rows())), scenes_(scenes) {
  const PreparedSurface<T> surface = prepare_surface(cloth, prepared);
  const PreparedFeatures features = prepare_features(body_faces);
  const std::vector<T> length = longest_edges(surface);
  const std::size_t s = static_cast<std::size_t>(scenes);
  longest_ = *std::max_element(length.begin(), length.end());
  faces_ = CudaBuffer<FaceIndices>(surface.faces);
  edges_ = CudaBuffer<ClothEdge>(surface.edges);
  across_ = CudaBuffer<int>(surface.across);
  ring_begin_ = CudaBuffer<int>(surface.ring_begin);
  ring_ = CudaBuffer<int>(surface.ring);
  edge_of_ = CudaBuffer<int>(edges_of_faces(surface.faces, surface.edges, false));
  length_ = CudaBuffer<T>(length);
  body_edges_ = CudaBuffer<ClothEdge>(features.edges);
  body_edge_of_ = CudaBuffer<int>(features.edge_of);
  body_corner_of_ = CudaBuffer<int>(features.corner_of);
  body_ring_begin_ = CudaBuffer<int>(features.ring_begin);
  body_ring_ = CudaBuffer<int>(features.ring);
  min_edge_ = CudaBuffer<T>(features.edges.size());
  least_ = CudaBuffer<T>(body_faces.size());
  sharp_ = CudaBuffer<int>(body_faces.size());
  any_ = CudaBuffer<int>(1);
  near_ = CudaBuffer<int>(s * surface.faces.size());
  near_faces_ = CudaBuffer<int>(s * surface.faces.size());
  near_count_ = CudaBuffer<int>(s);
  pushed_ = CudaBuffer<int>(s * prepared.external.size());
  pressed_ = CudaBuffer<int>(s);
  sums_ = CudaBuffer<ResponseSum>(s * prepared.external.size());
  sums_.clear();
}

template <class T>
void CudaFeatures<T>::describe(CudaFrame<T>& frame) {
  CudaFeatureFrame<T>& f = frame.features;
  f.cloth.surface.faces = faces_.data();
  f.cloth.surface.face_count = face_count_;
  f.cloth.edges = edges_.data();
  f.cloth.edge_count = static_cast<int>(edges_.size());
  f.cloth.across = across_.data();
  f.cloth.ring_begin = ring_begin_.data();
  f.cloth.ring = ring_.data();
  f.features.edges = body_edges_.data();
  f.features.edge_of = body_edge_of_.data();
  f.features.corner_of = body_corner_of_.data();
  f.features.ring_begin = body_ring_begin_.data();
  f.features.ring = body_ring_.data();
  f.features.sharp = sharp_.data();
  f.features.least = least_.data();
  f.features.nodes = nodes_.data();
  f.rule = feature_rule(frame.body_rule);
  f.edge_of = edge_of_.data();
  f.length = length_.data();
  f.any = any_.data();
  f.face_count = face_count_;
  f.near = near_.data();
  f.near_faces = near_faces_.data();
  f.near_count = near_count_.data();
  f.pushed = pushed_.data();
  f.pressed = pressed_.data();
  f.sums = sums_.data();
}

template <class T>
void CudaFeatures<T>::begin_frame(CudaBody<T>& body, CudaFrame<T>& frame, const Vec4<T>* x,
                                  const Vec4<T>* velocity) {
  const int edges = static_cast<int>(body_edges_.size());
  const int faces = frame.body.face_count;
  any_.clear();
  near_count_.clear();
  pressed_.clear();
  pushed_.clear();
  min_kernel<<<cuda_blocks(edges), kCudaBlock>>>(frame.body, body_edges_.data(), edges,
                                                 T(2) * frame.features.rule.gap, min_edge_.data());
  ATELIER_CUDA_LAUNCHED(min_kernel);
  sharp_kernel<<<cuda_blocks(faces), kCudaBlock>>>(frame.features.features, faces, min_edge_.data(),
                                                   longest_, sharp_.data(), least_.data(),
                                                   any_.data());
  ATELIER_CUDA_LAUNCHED(sharp_kernel);
  body.refit_where(sharp_.data(), nodes_);
  frame.features.features.nodes = nodes_.data();
  near_kernel<<<cuda_blocks(scenes_ * face_count_), kCudaBlock>>>(
      frame.features, frame.count, scenes_, frame.frame_time, x, velocity, frame.outlook);
  ATELIER_CUDA_LAUNCHED(near_kernel);
}

template class CudaFeatures<float>;
template class CudaFeatures<double>;

}  // namespace atelier
