#pragma once

#include <vector>

#include "simulation/contact/collision_response_math.h"
#include "simulation/contact/self_search_math.h"
#include "simulation/xpbd/box_groups.h"
#include "simulation/xpbd/prepared_surface.h"

namespace atelier {

/// The particles of a substep, as contacts move them.
template <class T>
struct SelfMotion {
  std::vector<Vec4<T>>& x;
  std::vector<Vec4<T>>& start;         ///< from which the speed follows
  std::vector<Vec4<T>>& carry;         ///< see SelfParticle
  const std::vector<Vec4<T>>& origin;  ///< where the substep began
  const std::vector<char>& touched;    ///< 1: lies on the body
};

/// Contact of the cloth with itself on the CPU (see self_contact_math.h).
template <class T>
class SelfContactCpu {
 public:
  SelfContactCpu(const Cloth& cloth, const PreparedCloth<T>& prepared, const XpbdOptions& options);

  /// Forgets the pairs of the last frame, so that a frame only depends on its state.
  void begin_frame();
  /// Begins a substep; `left` substeps of the frame are to come, this one included.
  void begin_substep(int left);
  /// From now on pushes leave pairs `share` of their gap and know no friction: for a solver that
  /// holds them at the whole gap itself.
  void push_nearer(T share) {
    gap_share_ = share;
    push_friction_ = T(0);
  }
  /// Pairs of a particle and a face that may come nearer than their gap where cloth goes from
  /// `motion.origin` to `motion.x`.
  const std::vector<SelfPair<T>>& near_faces(const SelfMotion<T>& motion);
  const SelfView<T>& view() const { return view_; }
  const SelfRule<T>& rule() const { return rule_; }
  /// Pushes pairs apart until none is pressed.
  void push(const SelfMotion<T>& motion);
  /// Keeps back what would pass; `pass` counts from 0. True if there was something: then the body
  /// has to be looked at again, and this.
  bool keep_back(const SelfMotion<T>& motion, int pass);

  /// True if particle `i` was pushed in the last `push`, or kept back in the last `keep_back`.
  bool moved(int i) const { return moved_[i] >= moved_from_; }
  bool comes_out(const std::vector<BodyOutlook<T>>& outlook, int i) const {
    return atelier::comes_out(view_, outlook.data(), i);
  }
  /// From now on `moved` is of everything that was kept back in the substep.
  void all_kept() { moved_from_ = kSelfResponses + 1; }
  int candidate_count() const { return static_cast<int>(face_pairs_.size() + edge_pairs_.size()); }
  int search_count() const { return searches_; }
  int renewal_count() const { return renewals_; }
  int active_count() const { return active_; }

 private:
  struct Crossing {
    int edge, face;
  };

  /// How an edge flies while a search looks ahead, to find soon that two stay apart.
  struct alignas(16) EdgeFlight {
    Vec3<T> middle, half;  ///< where it is, and from there to an end
    Vec3<T> on;            ///< motion of its middle
    T margin;              ///< slack, and by how much motions of its ends differ from that
    int a, b;
  };
  struct alignas(16) FaceFlight {
    Vec3<T> middle, first, second;  ///< and from there to two corners
    Vec3<T> on;
    T margin;
    FaceIndices corner;
  };
  EdgeFlight flight_of(const ClothEdge& e) const;
  FaceFlight flight_of(const FaceIndices& f) const;
  /// True if two stay further apart than pairs are looked for, as offer_edge and offer_face would
  /// find more slowly, or share a particle.
  bool stay_apart(const EdgeFlight& p, const EdgeFlight& q) const;
  bool stay_apart(int i, const FaceFlight& face) const;

  /// Makes new swept motions for particles that have left theirs or may do so soon. Returns how
  /// many.
  int renew_swept_bounds(const SelfMotion<T>& motion);
  /// Where an edge, a face or a particle flies, with its search margin.
  Box<T> swept_bound_with_margin(const ClothEdge& e) const {
    return inflated(swept_bound(view_, e), search_margin(rule_, edge_slack(view_, e, rule_)));
  }
  Box<T> swept_bound_with_margin(const FaceIndices& f) const {
    return inflated(swept_bound(view_, f), search_margin(rule_, face_slack(view_, f, rule_)));
  }
  Box<T> swept_bound_with_margin(int i) const {
    return inflated(swept_bound(view_, i), search_margin(rule_, slack_of(view_, i, rule_)));
  }
  /// Appends a pair that may meet within the swept motion.
  void try_edges(int e, int o, std::vector<SelfPair<T>>& out) const;
  void try_face(int i, int f, std::vector<SelfPair<T>>& out) const;
  /// A new search where the list does not hold; true if there was one.
  bool renew(const SelfMotion<T>& motion);
  void search(const SelfMotion<T>& motion);
  /// What was moved since the last look, and, once a substep, what is crossed.
  void note_stirred_and_crossed(const std::vector<Vec4<T>>& origin);
  /// At a substep's start: what is crossed, where something may have passed.
  void look_for_crossings(const std::vector<Vec4<T>>& origin);
  void set_crossings(std::vector<Crossing> crossings);
  /// Searches the pairs of particles with a new swept motion, in place of their earlier ones.
  void search_fresh();
  /// One pass of pushes over the pairs; `every`: also over those of which nothing moved since the
  /// last one. True if another is needed.
  bool push_once(const SelfMotion<T>& motion, int pass, bool every);
  /// One pass over the pairs; true if something was kept back.
  bool keep_once(const SelfMotion<T>& motion, int pass, bool every);
  /// Calls `work(pair, edges)` for the pairs worth looking at.
  template <class Work>
  void visit_pairs(int pass, bool every, const Work& work) const;
  /// Gives every particle what its pairs want; remembers in which pass.
  void take(const SelfMotion<T>& motion, int pass);

  PreparedSurface<T> surface_;
  SelfRule<T> rule_;
  T gap_share_ = T(1);
  T push_friction_;
  SelfView<T> view_{};
  std::vector<Vec4<T>> start_, end_;      ///< of the search
  std::vector<EdgeFlight> edge_flights_;  ///< in a search of all pairs, by places of near_edges_
  std::vector<FaceFlight> face_flights_;  ///< likewise
  std::vector<SelfPair<T>> face_pairs_, edge_pairs_;
  std::vector<Crossing> crossings_;
  std::vector<int> tangled_;
  std::vector<T> slack_;
  std::vector<int> stirred_;  ///< 1: contacts moved it since the last look, or it passed something
  std::vector<char> fresh_;   ///< 1: got a new swept motion in the last renewal
  GroupedBoxes near_particles_, near_edges_, near_faces_;  ///< of swept motions, with margins
  GroupedBoxes edges_now_, faces_now_;  ///< where the last look for crossings was
  std::vector<int> support_;
  std::vector<char> moved_;  ///< the last pass in which a particle was pushed, from 1; 0: none
  int moved_from_ = 1;
  std::vector<ResponseSum> sums_;
  int age_ = -1;   ///< substeps since the search, this one included; -1: none
  int left_ = 0;   ///< substeps to come in the frame
  int ahead_ = 1;  ///< substeps that the search looked ahead
  bool frame_begins_ = true;
  bool substep_begins_ = true;
  bool passed_ = false;  ///< something did or would have since the last look for crossings
  int searches_ = 0;
  int renewals_ = 0;  ///< of a part
  int active_ = 0;
};

extern template class SelfContactCpu<float>;
extern template class SelfContactCpu<double>;

}  // namespace atelier
