#include "simulation/projective/body_contacts.h"

#include <algorithm>

#include "core/parallel.h"
#include "simulation/xpbd/backend.h"

namespace atelier {
namespace {

constexpr Index kContactGrain = 256;

/// Where what a step passes through is looked for, beyond what is kept.
double guarded(double thickness) {
  return 0.9 * thickness;
}

}  // namespace

BodyContacts::BodyContacts(const Triangles& faces, const CommonSolverOptions& options,
                           const Material& material, int substeps)
    : body_faces_(faces), substeps_(substeps) {
  for (Index f = 0; f < faces.rows(); ++f) {
    faces_.push_back({faces(f, 0), faces(f, 1), faces(f, 2)});
  }
  rule_.thickness = options.thickness >= 0 ? options.thickness : material.thickness;
  rule_.friction = options.friction >= 0 ? options.friction : material.friction;
  rule_.reach = std::max(options.contact_reach, rule_.thickness);
  rule_.old_overlap = options.depenetration_speed * options.time_step / substeps;
  wide_ = rule_;
  // Tension presses cloth on that would fly past the body by itself.
  constexpr double kLeastMargin = 5e-4;  // m
  wide_.thickness = rule_.thickness + std::max(kLeastMargin, rule_.thickness);
  wide_.reach = std::max(wide_.reach, wide_.thickness);
}

void BodyContacts::begin_frame(const Control& control, double time_step,
                               const std::vector<Vec4<double>>& x,
                               const std::vector<Vec4<double>>& velocity,
                               const std::vector<Vec4<double>>& acceleration) {
  body_ = {};
  contacts_.clear();
  if (faces_.empty() || control.body_start.rows() == 0) {
    return;
  }
  const auto copy = [](const Points& from, std::vector<Vec4<double>>& to) {
    to.resize(static_cast<std::size_t>(from.rows()));
    for (Index i = 0; i < from.rows(); ++i) {
      to[i] = {from(i, 0), from(i, 1), from(i, 2), 0};
    }
  };
  copy(control.body_start, body_start_);
  copy(control.body_end, body_end_);
  body_ = {faces_.data(), body_start_.data(), body_end_.data(), nullptr,
           static_cast<int>(faces_.size())};
  std::vector<Box<double>> boxes(faces_.size());
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
  outlook_.resize(x.size());
  flight_.resize(x.size());
  candidates_.resize(x.size() * kBodyCandidates);
  found_.resize(x.size());
  frame_start_ = x;
  parallel_for(static_cast<Index>(x.size()), kContactGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const double slack = expected_deviation(xyz(acceleration[i]), time_step);
      flight_[i] = time_step * xyz(velocity[i]);
      outlook_[i] = x[i].w > 0
                        ? collect_candidates(body_, free_flight(i), slack, wide_,
                                             &candidates_[i * kBodyCandidates], AloneInTree{})
                        : BodyOutlook<double>{slack, 0, 0, {}, 0};
    }
  });
}

FaceChoice<double> BodyContacts::choose(Index i, const Passage<double>& way,
                                        BodySearch search) const {
  if (search == BodySearch::WayOut) {
    const double reach = std::min(wide_.reach, outlook_[i].gap);
    return {nearest_way_out(body_, way.p1, way.t1, reach, AloneInTree{}), no_offer(wide_.reach)};
  }
  if (search == BodySearch::Candidates) {
    return choose_candidate(body_, &candidates_[i * kBodyCandidates], outlook_[i].count, way,
                            wide_.reach, true);
  }
  Box<double> box{way.p0, way.p0};
  grow(box, way.p1);
  const double margin = search == BodySearch::DeepTree ? wide_.reach : wide_.thickness + 1e-3;
  FaceChoice<double> choice =
      choose_in_tree(body_, inflated(box, margin), way, wide_.reach, true, AloneInTree{});
  if (search == BodySearch::DeepTree && choice.first.time > 1 && choice.nearest.side >= 0 &&
      times_inside(body_, way.p1, way.t1, AloneInTree{}) > 0) {
    const FaceOffer<double> way_out =
        nearest_way_out(body_, way.p1, way.t1, wide_.reach, AloneInTree{});
    choice.nearest = way_out.face >= 0 ? way_out : choice.nearest;
  }
  return choice;
}

const std::vector<TouchedBody>& BodyContacts::find(int s, double h, std::vector<Vec4<double>>& x,
                                                   const std::vector<Vec4<double>>& flight) {
  contacts_.clear();
  if (empty()) {
    return contacts_;
  }
  const BodySubstep<double> step = substep(s, wide_);
  parallel_for(static_cast<Index>(x.size()), kContactGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      found_[i].particle = -1;
      if (!(x[i].w > 0)) {
        continue;
      }
      const Passage<double> way{xyz(x[i]), xyz(x[i]) + h * xyz(flight[i]), step.t0, step.t1};
      const BodySearch search = body_search(outlook_[i], way.p1, free_flight(i), step.t1);
      if (search == BodySearch::Nothing) {
        continue;
      }
      const FaceChoice<double> choice = choose(i, way, search);
      BodyTouch<double> touch;
      if (choice.first.time <= 1) {
        const FaceCorners<double> t = corners_at(body_, choice.first.face, step.t1);
        const Vec3d n = cross(t.b - t.a, t.c - t.a);
        touch = touch_at(body_, choice.first.face, choice.first.hit, (1 / norm(n)) * n, way);
      } else {
        touch = touch_nearest(body_, choice.nearest, way, wide_.thickness);
      }
      if (!touch.valid) {
        if (search == BodySearch::Candidates) {
          look_out_again(outlook_[i], choice.nearest, way.p1, free_flight(i), step.t1, wide_);
        }
        continue;
      }
      const double overlap = rule_.thickness - touch.start_distance;
      if (overlap > 0) {
        const double out = std::min(overlap, rule_.old_overlap);
        x[i] = with_w(xyz(x[i]) + out * touch.normal, x[i].w);
        touch.start_distance += out;
      }
      const double keep = std::min(rule_.thickness, touch.start_distance);
      const double at_end = touch.start_distance - dot(touch.normal, touch.moved);
      found_[i] = {static_cast<int>(i), touch.normal, (1 / h) * touch.moved, (keep - at_end) / h};
    }
  });
  for (const TouchedBody& contact : found_) {
    if (contact.particle >= 0) {
      contacts_.push_back(contact);
    }
  }
  return contacts_;
}

bool BodyContacts::keep_out(int s, int particle, BodyParticle<double>& p) {
  BodyContactRule<double> rule = rule_;
  rule.thickness = guarded(rule.thickness);
  rule.friction = 0;
  const BodySubstep<double> step = substep(s, rule);
  const Index i = particle;
  BodyOutlook<double> outlook = outlook_[i];
  const BodySearch search = body_search(outlook, xyz(p.x), free_flight(i), step.t1);
  if (search == BodySearch::Nothing) {
    return false;
  }
  if (search != BodySearch::Candidates) {
    return contact_by_tree(p, step, outlook, search, AloneInTree{});
  }
  const auto choose_face = [&](const Passage<double>& way, bool swept) {
    return choose_candidate(body_, &candidates_[i * kBodyCandidates], outlook.count, way,
                            rule.reach, swept);
  };
  return contact_by_candidates(p, step, outlook, free_flight(i), choose_face);
}

bool BodyContacts::meet(int s, int particle, BodyParticle<double>& p, const Vec4<double>& origin,
                        Meeting meeting) {
  return meeting == Meeting::Touches
             ? p.x.w > 0 && keep_out(s, particle, p)
             : stay_with_body(p, origin, substep(s, rule_), outlook_[particle], meeting);
}

void BodyContacts::end_outside(std::vector<Vec4<double>>& x) {
  if (empty() || !has_inside_) {
    return;
  }
  parallel_for(static_cast<Index>(x.size()), kContactGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      if (x[i].w > 0) {
        atelier::end_outside(body_, rule_, outlook_[i], free_flight(i), substeps_, x[i]);
      }
    }
  });
}

BodyContacts::Penetration BodyContacts::penetration(const std::vector<Vec4<double>>& x) const {
  Penetration out;
  if (empty()) {
    return out;
  }
  std::vector<double> depth(x.size(), 0.0);
  parallel_for(static_cast<Index>(x.size()), kContactGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      depth[i] = x[i].w > 0 ? depth_inside(body_, xyz(x[i]), rule_.reach) : 0;
    }
  });
  for (double d : depth) {
    out.count += d > 0 ? 1 : 0;
    out.depth = std::max(out.depth, d);
  }
  return out;
}

}  // namespace atelier
