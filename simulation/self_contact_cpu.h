#pragma once

#include <vector>

#include "simulation/prepared_surface.h"

namespace atelier {

/// Contact of the cloth with itself on the CPU (see self_contact_math.h).
template <class T>
class SelfContactCpu {
 public:
  SelfContactCpu(const Cloth& cloth, const PreparedCloth<T>& prepared, const XpbdOptions& options);

  /// Collects the pairs of the frame.
  void begin_frame(const std::vector<Vec4<T>>& x, const std::vector<Vec3<T>>& velocity, T frame);
  /// Pushes of every pair, averaged per particle and applied. `touched` tells which particles lie
  /// on the body.
  void solve(std::vector<Vec4<T>>& x, const std::vector<Vec4<T>>& start,
             const std::vector<char>& touched);

  int candidate_count() const { return candidates_; }
  int lost_count() const { return lost_; }
  int active_count() const { return active_; }

 private:
  PreparedSurface<T> surface_;
  SelfRule<T> rule_;
  SelfView<T> view_{};
  std::vector<Vec4<T>> start_, end_;
  std::vector<SelfPairs<T>> face_pairs_;
  std::vector<EdgePairs<T>> edge_pairs_;
  std::vector<int> tangled_;
  std::vector<PushSum> sums_;
  int candidates_ = 0;
  int lost_ = 0;
  int active_ = 0;
};

extern template class SelfContactCpu<float>;
extern template class SelfContactCpu<double>;

}  // namespace atelier
