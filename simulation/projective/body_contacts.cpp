#include "simulation/projective/body_contacts.h"

#include <algorithm>

#include "core/parallel.h"

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
    : body_(faces), substeps_(substeps) {
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
  contacts_.clear();
  found_.resize(x.size());
  velocity_.resize(x.size());
  acceleration_.resize(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    velocity_[i] = xyz(velocity[i]);
    acceleration_[i] = xyz(acceleration[i]);
  }
  body_.begin_frame(control, time_step, wide_, {x, velocity_, acceleration_});
}

FaceChoice<double> BodyContacts::choose(Index i, const Passage<double>& way,
                                        BodySearch search) const {
  const BodyView<double>& body = body_.body();
  if (search == BodySearch::WayOut) {
    const double reach = std::min(wide_.reach, outlook()[i].gap);
    return {nearest_way_out(body, way.p1, way.t1, reach, AloneInTree{}), no_offer(wide_.reach)};
  }
  if (search == BodySearch::Candidates) {
    return body_.choose(i, way, wide_.reach, true);
  }
  Box<double> box{way.p0, way.p0};
  grow(box, way.p1);
  const double margin = search == BodySearch::DeepTree ? wide_.reach : wide_.thickness + 1e-3;
  FaceChoice<double> choice =
      choose_in_tree(body, inflated(box, margin), way, wide_.reach, true, AloneInTree{});
  if (search == BodySearch::DeepTree && choice.first.time > 1 && choice.nearest.side >= 0 &&
      times_inside(body, way.p1, way.t1, AloneInTree{}) > 0) {
    const FaceOffer<double> way_out =
        nearest_way_out(body, way.p1, way.t1, wide_.reach, AloneInTree{});
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
      const FreeFlight<double> free = body_.free_flight(i);
      const BodySearch search = body_search(outlook()[i], way.p1, free, step.t1);
      if (search == BodySearch::Nothing) {
        continue;
      }
      const FaceChoice<double> choice = choose(i, way, search);
      BodyTouch<double> touch;
      if (choice.first.time <= 1) {
        const FaceCorners<double> t = corners_at(body_.body(), choice.first.face, step.t1);
        const Vec3d n = cross(t.b - t.a, t.c - t.a);
        touch = touch_at(body_.body(), choice.first.face, choice.first.hit, (1 / norm(n)) * n, way);
      } else {
        touch = touch_nearest(body_.body(), choice.nearest, way, wide_.thickness);
      }
      if (!touch.valid) {
        if (search == BodySearch::Candidates) {
          look_out_again(body_.outlook()[i], choice.nearest, way.p1, free, step.t1, wide_);
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
  BodyOutlook<double> outlook = body_.outlook()[particle];  // renewed for a wider distance alone
  return body_.touch(particle, p, substep(s, rule), outlook);
}

bool BodyContacts::meet(int s, int particle, BodyParticle<double>& p, const Vec4<double>& origin,
                        Meeting meeting) {
  return meeting == Meeting::Touches
             ? p.x.w > 0 && keep_out(s, particle, p)
             : stay_with_body(p, origin, substep(s, rule_), outlook()[particle], meeting);
}

}  // namespace atelier
