#pragma once

#include "core/cuda_buffer.cuh"
#include "core/types.h"
#include "simulation/contact/body_contact_math.h"

namespace atelier {

/// A stream beside the usual one.
class SideStream {
 public:
  SideStream();
  ~SideStream();
  SideStream(const SideStream&) = delete;
  SideStream& operator=(const SideStream&) = delete;

  /// The stream, on which what follows waits for what the usual one has been given.
  cudaStream_t fork();
  /// What follows on the usual one waits for this one.
  void join();

 private:
  cudaStream_t stream_ = nullptr;
  cudaEvent_t forked_ = nullptr;
  cudaEvent_t done_ = nullptr;
};

/// A moving surface on the device, its tree and the boxes over groups of its faces: built there on
/// the first frame, refitted afterwards.
template <class T>
class CudaBody {
 public:
  explicit CudaBody(const Triangles& faces);

  bool empty() const { return face_count_ == 0; }
  /// Uploads the motion of the next frame; the first builds the tree.
  void move(const Points& start, const Points& end);
  /// Takes the boxes of the motion over into the groups and, beside what follows, into the tree:
  /// launch_candidates for so many particles may follow, then wait_for_tree.
  void refit(int particles);
  void wait_for_tree() { beside_.join(); }
  /// Makes `nodes` the same tree over the faces that `keep` holds alone.
  void refit_where(const int* keep, CudaBuffer<BoxNode<T>>& nodes);
  const std::vector<FaceIndices>& faces() const { return host_faces_; }
  BodyView<T> view() const;

 private:
  void build(const Box<T>& bounds);
  void refit_nodes(const int* keep, BoxNode<T>* nodes, cudaStream_t stream);
  void order_boxes(const Points& vertices);

  int face_count_ = 0;
  std::vector<FaceIndices> host_faces_;
  CudaBuffer<FaceIndices> faces_;
  CudaBuffer<Vec4<T>> start_;
  CudaBuffer<Vec4<T>> end_;
  std::vector<Vec4<T>> staging_;
  CudaBuffer<BoxNode<T>> nodes_;
  CudaBuffer<TreeParent> node_parent_;
  CudaBuffer<TreeParent> leaf_parent_;
  CudaBuffer<unsigned> arrivals_;
  CudaBuffer<int> ordered_;  ///< faces in groups that lie together (near_groups.h)
  CudaBuffer<Box<T>> box_, group_, whole_;
  bool built_ = false;
  SideStream beside_;
};

/// Particles at the start of a frame, and how long it is.
template <class T>
struct FrameParticles {
  int count;
  const Vec4<T>* x;
  const Vec4<T>* velocity;
  T time;  ///< s, of the frame

  __device__ FreeFlight<T> flight(int i) const { return {xyz(x[i]), time * xyz(velocity[i])}; }
};

/// Forces on them.
template <class T>
struct FrameForces {
  const Vec4<T>* air;  ///< accelerations [m/s2]; null: none
  Vec3<T> gravity;
};

/// Collects what every particle may meet during the frame (see collect_candidates).
template <class T>
void launch_candidates(const BodyView<T>& body, const BodyContactRule<T>& rule,
                       const FrameParticles<T>& particles, const FrameForces<T>& forces,
                       BodyOutlook<T>* outlook, int* candidates);

/// Depth of every particle inside the body at the end of the frame.
template <class T>
void launch_depths(const BodyView<T>& body, T reach, int particles, const Vec4<T>* x, T* depth);

/// Sets on the surface who would end the frame inside (see end_outside). `x`: where they end it.
template <class T>
void launch_end_outside(const BodyView<T>& body, const BodyContactRule<T>& rule,
                        const FrameParticles<T>& particles, const BodyOutlook<T>* outlook,
                        int substeps, Vec4<T>* x);

}  // namespace atelier
