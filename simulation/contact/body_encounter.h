#pragma once

#include <vector>

#include "simulation/cloth/cloth_state.h"
#include "simulation/contact/body_contact_math.h"
#include "simulation/contact/contact_tree.h"

namespace atelier {

/// True for a body whose surface is closed: only then is there an inside that no cloth may be in.
/// `body`: its vertices in any pose; those in one place, as at seams of its texture, are one.
bool has_inside(const Points& body, const Triangles& body_faces);

/// The cloth's particles at the start of a frame.
template <class T>
struct ParticlesAtStart {
  const std::vector<Vec4<T>>& x;             ///< w: inverse mass
  const std::vector<Vec3<T>>& velocity;      ///< m/s
  const std::vector<Vec3<T>>& acceleration;  ///< m/s2, of gravity and air
};

/// How many free particles are inside a body, and the deepest's depth [m].
struct BodyPenetration {
  int count = 0;
  double depth = 0;
};

/// A moving body and what each particle may meet of it in a frame, on the CPU: the broad phase of
/// every solver's contact (body_contact_math.h).
template <class T>
class BodyEncounter {
 public:
  /// `faces` [F,3] over the body's vertices in Control.
  explicit BodyEncounter(const Triangles& faces);

  /// Takes over the body's motion in a frame of `seconds` and collects what each particle may meet
  /// by `rule`.
  void begin_frame(const Control& control, T seconds, const BodyContactRule<T>& rule,
                   const ParticlesAtStart<T>& particles);

  /// No body in this frame.
  bool empty() const { return body_.face_count == 0; }
  const BodyView<T>& body() const { return body_; }
  const ContactTree<T>& tree() const { return tree_; }
  const std::vector<FaceIndices>& faces() const { return faces_; }
  const std::vector<Vec3<T>>& flight() const { return flight_; }
  std::vector<BodyOutlook<T>>& outlook() { return outlook_; }
  const std::vector<BodyOutlook<T>>& outlook() const { return outlook_; }
  FreeFlight<T> free_flight(Index i) const { return {xyz(frame_start_[i]), flight_[i]}; }
  /// The face that particle `i` meets among its candidates on a way.
  FaceChoice<T> choose(Index i, const Passage<T>& way, T reach, bool swept) const {
    return choose_candidate(body_, &candidates_[i * kBodyCandidates], outlook_[i].count, way, reach,
                            swept);
  }

  /// Particle `i`, of that outlook, meets the body's faces in a substep. Returns whether it
  /// touches.
  bool touch(Index i, BodyParticle<T>& p, const BodySubstep<T>& step,
             BodyOutlook<T>& outlook) const;
  /// See end_outside in body_contact_math.h; `x` [V] at the end of a frame of `substeps`.
  void end_outside(const BodyContactRule<T>& rule, int substeps, std::vector<Vec4<T>>& x) const;
  /// Of free particles at `x`, no deeper than `reach` metres.
  BodyPenetration penetration(T reach, const std::vector<Vec4<T>>& x) const;

 private:
  Triangles body_faces_;
  std::vector<FaceIndices> faces_;
  std::vector<Vec4<T>> body_start_, body_end_;
  ContactTree<T> tree_;
  BodyView<T> body_{};
  bool has_inside_ = false;
  std::vector<Vec4<T>> frame_start_;
  std::vector<Vec3<T>> flight_;  ///< free flight of the frame
  std::vector<BodyOutlook<T>> outlook_;
  std::vector<int> candidates_;
};

extern template class BodyEncounter<float>;
extern template class BodyEncounter<double>;

}  // namespace atelier
