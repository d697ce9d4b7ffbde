#pragma once

#include "core/cuda_buffer.cuh"
#include "simulation/xpbd/cuda_scene.cuh"
#include "simulation/xpbd/prepared_surface.h"

namespace atelier {

/// Contact of the cloth with itself on the device: the surface, boxes over it, the lists of pairs.
template <class T>
class CudaSelf {
 public:
  CudaSelf(const Cloth& cloth, const PreparedCloth<T>& prepared, const XpbdOptions& options,
           int scenes);

  /// See SelfContactCpu.
  void push_nearer(T share) {
    gap_share_ = share;
    push_friction_ = T(0);
  }
  const SelfRule<T>& rule() const { return rule_; }
  /// Tells the frame where everything is, and begins to count.
  void describe(CudaFrame<T>& frame);
  /// Waits for the frame. True if a list of pairs was too short: the frame has to be done again,
  /// with more room.
  bool too_short();
  /// Makes the room that was missing. Throws EnvironmentError where the device has not that much:
  /// then there is none, and the next frame finds so.
  void grow();
  /// Fills in counts of contacts, candidates and searches.
  void count(std::vector<FrameReport>& reports) const;
  /// Forgets pushes that were not applied.
  void reset() { sums_.clear(); }

 private:
  /// Room for the boxes over groups.
  struct Boxes {
    CudaBuffer<Box<T>> box, group, whole;
    CudaBuffer<unsigned> fresh;

    Boxes() = default;
    Boxes(int count, int scenes);
    BoxGroups<T> over(const CudaBuffer<GroupedItem>& items);
  };

  void make_room(int room);

  int scenes_;
  int particles_;
  int face_count_;
  int edge_count_;
  int room_ = 0;    ///< of the lists
  int needed_ = 0;  ///< by the last frame
  SelfRule<T> rule_;
  T gap_share_ = T(1);
  T push_friction_;
  CudaBuffer<FaceIndices> faces_;
  CudaBuffer<ClothEdge> edges_;
  CudaBuffer<int> across_, ring_begin_, ring_;
  CudaBuffer<Vec4<T>> rest_;
  CudaBuffer<int> layer_;
  CudaBuffer<GroupedItem> particle_items_, edge_items_, face_items_;  ///< see near_groups.h
  Boxes particle_boxes_, edge_boxes_, face_boxes_, edge_boxes_now_, face_boxes_now_;
  CudaBuffer<Vec4<T>> start_, end_, origin_, carry_;
  CudaBuffer<int> tangled_, emerges_, support_;
  CudaBuffer<T> slack_;  ///< m, of particles
  CudaBuffer<int> flown_, stirred_;
  CudaBuffer<ResponseSum> sums_;
  CudaBuffer<SelfPair<T>> face_pairs_, edge_pairs_;
  CudaBuffer<int2> crossings_;
  CudaBuffer<SelfCounts> counts_;
  std::vector<SelfCounts> host_counts_;
};

extern template class CudaSelf<float>;
extern template class CudaSelf<double>;

}  // namespace atelier
