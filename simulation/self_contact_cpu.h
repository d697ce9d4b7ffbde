#pragma once

#include <vector>

#include "simulation/prepared_surface.h"

namespace atelier {

/// Contact of the cloth with itself on the CPU (see self_contact_math.h).
template <class T>
class SelfContactCpu {
 public:
  SelfContactCpu(const Cloth& cloth, const PreparedCloth<T>& prepared, const XpbdOptions& options);

  /// Forgets the pairs of the last frame, so that a frame only depends on its state.
  void begin_frame();
  /// Begins a substep; `left` substeps of the frame are to come, this one included.
  void begin_substep(int left);
  /// Pushes pairs apart until none is pressed. `touched` tells which particles lie on the body.
  void solve(std::vector<Vec4<T>>& x, std::vector<Vec4<T>>& start,
             const std::vector<char>& touched);

  /// True if particle `i` was pushed in the last solve.
  bool moved(int i) const { return moved_[i] != 0; }
  int candidate_count() const { return static_cast<int>(face_pairs_.size() + edge_pairs_.size()); }
  int search_count() const { return searches_; }
  int active_count() const { return active_; }

 private:
  struct Crossing {
    int edge, face;
  };

  bool holds(const std::vector<Vec4<T>>& x) const;
  void search(const std::vector<Vec4<T>>& x, const std::vector<Vec4<T>>& start);
  /// One pass over the pairs; `every`: also over those of which nothing moved since the last one.
  /// True if another is needed.
  bool push(const std::vector<Vec4<T>>& x, const std::vector<Vec4<T>>& start, int pass, bool every);

  PreparedSurface<T> surface_;
  SelfRule<T> rule_;
  SelfView<T> view_{};
  std::vector<Vec4<T>> start_, end_;  ///< of the search
  std::vector<SelfPair<T>> face_pairs_, edge_pairs_;
  std::vector<Crossing> crossings_;
  std::vector<int> tangled_;
  std::vector<int> support_;
  std::vector<char> moved_;  ///< the last pass in which a particle was pushed, from 1; 0: none
  std::vector<PushSum> sums_;
  std::vector<Vec4<T>> calm_;  ///< pushes of the substep that do not become speed
  int age_ = -1;               ///< substeps since the search, this one included; -1: none
  int left_ = 0;               ///< substeps to come in the frame
  int ahead_ = 1;              ///< substeps that the search looked ahead
  int searches_ = 0;
  int active_ = 0;
};

extern template class SelfContactCpu<float>;
extern template class SelfContactCpu<double>;

}  // namespace atelier
