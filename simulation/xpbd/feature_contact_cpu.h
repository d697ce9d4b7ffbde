#pragma once

#include <vector>

#include "simulation/contact/contact_tree.h"
#include "simulation/xpbd/prepared_features.h"

namespace atelier {

/// Contact of the body's sharp features with the cloth on the CPU (see body_feature_math.h).
template <class T>
class FeatureContactCpu {
 public:
  FeatureContactCpu(const Cloth& cloth, const PreparedCloth<T>& prepared,
                    const std::vector<FaceIndices>& body_faces);

  /// Begins a frame of the body, whose tree is `tree`: what is sharp, and which triangles of the
  /// cloth may meet it. `flight` in the frame and `outlook` of the particles at `x`.
  void begin_frame(const BodyView<T>& body, const ContactTree<T>& tree,
                   const BodyContactRule<T>& rule, const std::vector<Vec4<T>>& x,
                   const std::vector<Vec3<T>>& flight, const std::vector<BodyOutlook<T>>& outlook);
  /// Pushes the cloth off in the substep [t0, t1] of the frame: `x`, and `start`, from which the
  /// speed follows; sets `touched` of the particles that it pushed.
  void push(std::vector<Vec4<T>>& x, std::vector<Vec4<T>>& start, T t0, T t1,
            std::vector<char>& touched);

 private:
  void find_sharp(const Box<T>& around);
  /// Which particles left their flights by time `t1` of the frame; true if any.
  bool find_left(const std::vector<Vec4<T>>& x, T t1);

  PreparedSurface<T> surface_;
  std::vector<int> edge_of_;  ///< of the cloth, see push_off_face
  PreparedFeatures features_;
  std::vector<T> length_;  ///< of the cloth's faces, their longest edges
  T longest_ = T(0);
  std::vector<T> min_edge_, least_;  ///< see BodyFeatures, of edges and faces
  std::vector<int> sharp_;
  ContactTree<T> tree_;  ///< over faces with sharp features
  bool any_ = false;     ///< there is something sharp
  FeatureStep<T> step_{};
  std::vector<Vec4<T>> frame_start_;
  std::vector<Vec3<T>> flight_;
  std::vector<T> slack_;
  std::vector<char> left_;
  std::vector<char> near_;  ///< of faces: may meet something sharp in the frame
  std::vector<int> active_;
  std::vector<ResponseSum> sums_;
};

extern template class FeatureContactCpu<float>;
extern template class FeatureContactCpu<double>;

}  // namespace atelier
