#include "simulation/contact/body_encounter.h"

#include <algorithm>

#include "core/parallel.h"
#include "core/topology.h"
#include "core/welded_faces.h"

namespace atelier {
namespace {

constexpr Index kEncounterGrain = 256;

template <class T>
void copy_vertices(const Points& from, std::vector<Vec4<T>>& to) {
  to.resize(static_cast<std::size_t>(from.rows()));
  for (Index i = 0; i < from.rows(); ++i) {
    to[i] = {static_cast<T>(from(i, 0)), static_cast<T>(from(i, 1)), static_cast<T>(from(i, 2)),
             T(0)};
  }
}

}  // namespace

bool has_inside(const Points& body, const Triangles& body_faces) {
  return body_faces.rows() > 0 &&
         is_closed(topology_of(welded_faces(body, body_faces), body.rows()));
}

template <class T>
BodyEncounter<T>::BodyEncounter(const Triangles& faces) : body_faces_(faces) {
  for (Index f = 0; f < faces.rows(); ++f) {
    faces_.push_back({faces(f, 0), faces(f, 1), faces(f, 2)});
  }
}

template <class T>
void BodyEncounter<T>::begin_frame(const Control& control, T seconds,
                                   const BodyContactRule<T>& rule,
                                   const ParticlesAtStart<T>& particles) {
  body_ = {};
  if (faces_.empty() || control.body_start.rows() == 0) {
    return;
  }
  copy_vertices(control.body_start, body_start_);
  copy_vertices(control.body_end, body_end_);
  body_ = {faces_.data(), body_start_.data(), body_end_.data(), nullptr,
           static_cast<int>(faces_.size())};
  std::vector<Box<T>> boxes(faces_.size());
  for (std::size_t f = 0; f < boxes.size(); ++f) {
    boxes[f] = swept_box(body_, static_cast<int>(f));
  }
  if (tree_.nodes.empty()) {
    tree_ = build_contact_tree(boxes);
    has_inside_ = has_inside(control.body_start, body_faces_);
  } else {
    refit_contact_tree(tree_, boxes);
  }
  body_.nodes = tree_.nodes.data();
  const std::size_t n = particles.x.size();
  outlook_.resize(n);
  flight_.resize(n);
  candidates_.resize(n * kBodyCandidates);
  frame_start_ = particles.x;
  parallel_for(static_cast<Index>(n), kEncounterGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const T slack = expected_deviation(particles.acceleration[i], seconds);
      flight_[i] = seconds * particles.velocity[i];
      outlook_[i] = particles.x[i].w > T(0)
                        ? collect_candidates(body_, free_flight(i), slack, rule,
                                             &candidates_[i * kBodyCandidates], AloneInTree{})
                        : BodyOutlook<T>{slack, T(0), T(0), {}, 0};
    }
  });
}

template <class T>
bool BodyEncounter<T>::touch(Index i, BodyParticle<T>& p, const BodySubstep<T>& step,
                             BodyOutlook<T>& outlook) const {
  const BodySearch search = body_search(outlook, xyz(p.x), free_flight(i), step.t1);
  if (search == BodySearch::Nothing) {
    return false;
  }
  if (search != BodySearch::Candidates) {
    return contact_by_tree(p, step, outlook, search, AloneInTree{});
  }
  const auto choose_face = [&](const Passage<T>& way, bool swept) {
    return choose(i, way, step.rule.reach, swept);
  };
  return contact_by_candidates(p, step, outlook, free_flight(i), choose_face);
}

template <class T>
void BodyEncounter<T>::end_outside(const BodyContactRule<T>& rule, int substeps,
                                   std::vector<Vec4<T>>& x) const {
  if (empty() || !has_inside_) {
    return;
  }
  parallel_for(static_cast<Index>(x.size()), kEncounterGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      if (x[i].w > T(0)) {
        atelier::end_outside(body_, rule, outlook_[i], free_flight(i), substeps, x[i],
                             AloneInTree{});
      }
    }
  });
}

template <class T>
BodyPenetration BodyEncounter<T>::penetration(T reach, const std::vector<Vec4<T>>& x) const {
  BodyPenetration out;
  if (empty()) {
    return out;
  }
  std::vector<T> depth(x.size(), T(0));
  parallel_for(static_cast<Index>(x.size()), kEncounterGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      depth[i] = x[i].w > T(0) ? depth_inside(body_, xyz(x[i]), reach) : T(0);
    }
  });
  for (T d : depth) {
    out.count += d > T(0) ? 1 : 0;
    out.depth = std::max(out.depth, static_cast<double>(d));
  }
  return out;
}

template class BodyEncounter<float>;
template class BodyEncounter<double>;

}  // namespace atelier
