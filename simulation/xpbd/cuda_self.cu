#include <algorithm>
#include <array>
#include <vector>

#include "simulation/xpbd/cuda_self.cuh"

namespace atelier {
namespace {

/// Substeps that a search looks ahead where nobody asks for more, as it was measured
/// (docs/decisions/0006-xpbd-patches.md). Where every block has a scene of its own, the search is
/// most of a frame, as a scene has few threads to share it: rarer ones pay for longer lists.
constexpr int kUsualInterval = 2;
constexpr int kSweepInterval = 5;

/// Groups through which a warp does not look one by one.
constexpr int kMany = 64;

int usual_interval(int scenes) {
  int device = 0;
  int multiprocessors = 0;
  ATELIER_CUDA_CHECK(cudaGetDevice(&device));
  ATELIER_CUDA_CHECK(
      cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  return scenes < multiprocessors ? kUsualInterval : kSweepInterval;
}

/// In groups that lie together at rest.
template <class T>
std::vector<GroupedItem> grouped(const std::vector<GroupedItem>& items,
                                 const std::vector<Vec4<T>>& rest) {
  std::vector<std::array<double, 3>> centres;
  centres.reserve(items.size());
  for (const GroupedItem& item : items) {
    const Vec3<T> sum = xyz(rest[item.a]) + xyz(rest[item.b]) + xyz(rest[item.c]);
    centres.push_back(
        {static_cast<double>(sum.x), static_cast<double>(sum.y), static_cast<double>(sum.z)});
  }
  std::vector<GroupedItem> out;
  out.reserve(items.size());
  for (int i : near_group_order(centres)) {
    out.push_back(items[i]);
  }
  return out;
}

}  // namespace

template <class T>
CudaSelf<T>::Boxes::Boxes(int count, int scenes) {
  const std::size_t s = static_cast<std::size_t>(scenes);
  const std::size_t groups = static_cast<std::size_t>(BoxGroups<T>::parts(count));
  const std::size_t wholes =
      static_cast<std::size_t>(BoxGroups<T>::parts(static_cast<int>(groups)));
  box = CudaBuffer<Box<T>>(s * groups * kGroup);
  group = CudaBuffer<Box<T>>(s * groups);
  whole = CudaBuffer<Box<T>>(s * wholes);
  fresh = CudaBuffer<unsigned>(s * groups);
}

template <class T>
BoxGroups<T> CudaSelf<T>::Boxes::over(const CudaBuffer<GroupedItem>& items) {
  const int groups = BoxGroups<T>::parts(static_cast<int>(items.size()));
  return {items.data(),  static_cast<int>(items.size()),
          box.data(),    group.data(),
          whole.data(),  fresh.data(),
          groups > kMany};
}

template <class T>
CudaSelf<T>::CudaSelf(const Cloth& cloth, const PreparedCloth<T>& prepared,
                      const XpbdOptions& options, int scenes)
    : scenes_(scenes),
      particles_(prepared.count),
      rule_(self_rule<T>(cloth, options, usual_interval(scenes))),
      push_friction_(rule_.friction) {
  const PreparedSurface<T> surface = prepare_surface(cloth, prepared);
  face_count_ = static_cast<int>(surface.faces.size());
  edge_count_ = static_cast<int>(surface.edges.size());
  faces_ = CudaBuffer<FaceIndices>(surface.faces);
  edges_ = CudaBuffer<ClothEdge>(surface.edges);
  across_ = CudaBuffer<int>(surface.across);
  ring_begin_ = CudaBuffer<int>(surface.ring_begin);
  ring_ = CudaBuffer<int>(surface.ring);
  rest_ = CudaBuffer<Vec4<T>>(surface.rest);
  layer_ = CudaBuffer<int>(surface.layer);
  const std::size_t s = static_cast<std::size_t>(scenes);
  std::vector<GroupedItem> particles;
  std::vector<GroupedItem> edges;
  std::vector<GroupedItem> faces;
  for (int i = 0; i < particles_; ++i) {
    particles.push_back({i, i, i, i});
  }
  for (int e = 0; e < edge_count_; ++e) {
    const ClothEdge& edge = surface.edges[e];
    edges.push_back({edge.a, edge.b, edge.b, e});
  }
  for (int f = 0; f < face_count_; ++f) {
    const FaceIndices& face = surface.faces[f];
    faces.push_back({face.a, face.b, face.c, f});
  }
  particle_items_ = CudaBuffer<GroupedItem>(grouped(particles, surface.rest));
  edge_items_ = CudaBuffer<GroupedItem>(grouped(edges, surface.rest));
  face_items_ = CudaBuffer<GroupedItem>(grouped(faces, surface.rest));
  particle_boxes_ = Boxes(particles_, scenes);
  for (Boxes* boxes : {&edge_boxes_, &edge_boxes_now_}) {
    *boxes = Boxes(edge_count_, scenes);
  }
  for (Boxes* boxes : {&face_boxes_, &face_boxes_now_}) {
    *boxes = Boxes(face_count_, scenes);
  }
  const std::size_t n = s * static_cast<std::size_t>(particles_);
  start_ = CudaBuffer<Vec4<T>>(n);
  end_ = CudaBuffer<Vec4<T>>(n);
  origin_ = CudaBuffer<Vec4<T>>(n);
  carry_ = CudaBuffer<Vec4<T>>(n);
  tangled_ = CudaBuffer<int>(n);
  slack_ = CudaBuffer<T>(std::vector<T>(n, rule_.slack));
  flown_ = CudaBuffer<int>(n);
  stirred_ = CudaBuffer<int>(n);
  emerges_ = CudaBuffer<int>(n);
  support_ = CudaBuffer<int>(n);
  sums_ = CudaBuffer<ResponseSum>(n);
  sums_.clear();
  counts_ = CudaBuffer<SelfCounts>(s);
  make_room(std::max(1024, 2 * particles_));
}

template <class T>
void CudaSelf<T>::make_room(int room) {
  const std::size_t all = static_cast<std::size_t>(room) * static_cast<std::size_t>(scenes_);
  // The old ones go first: there may not be memory for both.
  room_ = 0;
  face_pairs_ = CudaBuffer<SelfPair<T>>();
  edge_pairs_ = CudaBuffer<SelfPair<T>>();
  crossings_ = CudaBuffer<int2>();
  face_pairs_ = CudaBuffer<SelfPair<T>>(all);
  edge_pairs_ = CudaBuffer<SelfPair<T>>(3 * all);
  crossings_ = CudaBuffer<int2>(all);
  room_ = room;
}

template <class T>
void CudaSelf<T>::describe(CudaFrame<T>& frame) {
  CudaSelfFrame<T>& self = frame.self;
  self.cloth = {{faces_.data(), start_.data(), end_.data(), nullptr, face_count_},
                edges_.data(),
                edge_count_,
                across_.data(),
                ring_begin_.data(),
                ring_.data(),
                rest_.data(),
                layer_.data(),
                tangled_.data(),
                slack_.data()};
  self.rule = rule_;
  self.rule.friction = push_friction_;
  self.gap_share = gap_share_;
  self.start = start_.data();
  self.end = end_.data();
  self.tangled = tangled_.data();
  self.slack = slack_.data();
  self.flown = flown_.data();
  self.stirred = stirred_.data();
  self.particles = particle_boxes_.over(particle_items_);
  self.edges = edge_boxes_.over(edge_items_);
  self.faces = face_boxes_.over(face_items_);
  self.edges_now = edge_boxes_now_.over(edge_items_);
  self.faces_now = face_boxes_now_.over(face_items_);
  self.sums = sums_.data();
  self.origin = origin_.data();
  self.carry = carry_.data();
  self.emerges = emerges_.data();
  self.support = support_.data();
  self.face_pairs = face_pairs_.data();
  self.edge_pairs = edge_pairs_.data();
  self.crossings = crossings_.data();
  self.room = room_;
  self.counts = counts_.data();
  ATELIER_CUDA_CHECK(cudaMemsetAsync(counts_.data(), 0, counts_.size() * sizeof(SelfCounts)));
}

template <class T>
bool CudaSelf<T>::too_short() {
  host_counts_ = counts_.download();
  needed_ = 0;
  for (const SelfCounts& counts : host_counts_) {
    needed_ = std::max(needed_, counts.most);
  }
  return needed_ > room_;
}

template <class T>
void CudaSelf<T>::grow() {
  make_room(needed_ + needed_ / 4);
}

template <class T>
void CudaSelf<T>::count(std::vector<FrameReport>& reports) const {
  for (std::size_t scene = 0; scene < host_counts_.size(); ++scene) {
    const SelfCounts& counts = host_counts_[scene];
    reports[scene].self_contacts = counts.pushes;
    reports[scene].self_candidates = counts.face_pairs + counts.edge_pairs;
    reports[scene].self_searches = counts.searches;
    reports[scene].self_renewals = counts.renewals;
  }
}

template class CudaSelf<float>;
template class CudaSelf<double>;

}  // namespace atelier
