#pragma once

#include "simulation/cloth/cloth.h"
#include "simulation/cloth/solver_options.h"
#include "simulation/contact/body_contact_math.h"
#include "simulation/projective/coulomb.h"

namespace atelier {

/// Of the distances that impulses hold: what iterations left nearer is moved out.
constexpr double kGuardShare = 0.9;

/// A bound on the velocity of a particle that may touch the body within a step.
struct VelocityBound {
  Vec3d normal;  ///< outwards, unit
  Vec3d moves;   ///< m/s, velocity of the body's point
  double least;  ///< m/s, least velocity along the normal: faster into the body is too deep
  int holds;     ///< 0: there is none
};

/// Contact with the body: what is kept, how far beyond it a step looks for contacts, and where what
/// passed in spite of them is looked for.
struct BoundRules {
  BodyContactRule<double> kept;
  BodyContactRule<double> wide;
  BodyContactRule<double> guard;
};

/// Those of a cloth of `material` in substeps, `substeps` a frame.
inline BoundRules bound_rules(const CommonSolverOptions& options, const Material& material,
                              int substeps) {
  BodyContactRule<double> kept{};
  kept.thickness = options.thickness >= 0 ? options.thickness : material.thickness;
  kept.friction = options.friction >= 0 ? options.friction : material.friction;
  kept.reach = max_of(options.contact_reach, kept.thickness);
  kept.old_overlap = options.depenetration_speed * options.time_step / substeps;
  BoundRules out{kept, kept, kept};
  // Tension presses cloth on that would fly past the body by itself.
  constexpr double kLeastMargin = 5e-4;  // m
  out.wide.thickness = kept.thickness + max_of(kLeastMargin, kept.thickness);
  out.wide.reach = max_of(kept.reach, out.wide.thickness);
  out.guard.thickness = kGuardShare * kept.thickness;
  out.guard.friction = 0;
  return out;
}

/// What a particle on its way meets first or is nearest to. `of_candidates(way)` chooses among its
/// candidates (choose_candidate); `team` asks the body's tree.
template <class OfCandidates, class Team>
ATELIER_HOST_DEVICE inline FaceChoice<double> choose_on_way(
    const BodyView<double>& body, const BodyOutlook<double>& outlook, const Passage<double>& way,
    BodySearch search, const BodyContactRule<double>& wide, const OfCandidates& of_candidates,
    const Team& team) {
  if (search == BodySearch::WayOut) {
    const double reach = min_of(wide.reach, outlook.gap);
    return {nearest_way_out(body, way.p1, way.t1, reach, team), no_offer(wide.reach)};
  }
  if (search == BodySearch::Candidates) {
    return of_candidates(way);
  }
  Box<double> box{way.p0, way.p0};
  grow(box, way.p1);
  const double margin = search == BodySearch::DeepTree ? wide.reach : wide.thickness + 1e-3;
  FaceChoice<double> choice =
      choose_in_tree(body, inflated(box, margin), way, wide.reach, true, team);
  if (search == BodySearch::DeepTree && choice.first.time > 1 && choice.nearest.side >= 0 &&
      times_inside(body, way.p1, way.t1, team) > 0) {
    const FaceOffer<double> way_out = nearest_way_out(body, way.p1, way.t1, wide.reach, team);
    choice.nearest = way_out.face >= 0 ? way_out : choice.nearest;
  }
  return choice;
}

/// The bound that a choice means, in a step of `h` s. A particle that is too near already is moved
/// out, slowly (`x` changes): that does not become velocity.
ATELIER_HOST_DEVICE inline VelocityBound bound_of_choice(const BodyView<double>& body,
                                                         const FaceChoice<double>& choice,
                                                         const Passage<double>& way,
                                                         const BoundRules& rules, double h,
                                                         Vec4<double>& x) {
  BodyTouch<double> touch;
  if (choice.first.time <= 1) {
    const FaceCorners<double> t = corners_at(body, choice.first.face, way.t1);
    const Vec3d n = cross(t.b - t.a, t.c - t.a);
    touch = touch_at(body, choice.first.face, choice.first.hit, (1 / norm(n)) * n, way);
  } else {
    touch = touch_nearest(body, choice.nearest, way, rules.wide.thickness);
  }
  if (!touch.valid) {
    return {};
  }
  const double overlap = rules.kept.thickness - touch.start_distance;
  if (overlap > 0) {
    const double out = min_of(overlap, rules.kept.old_overlap);
    x = with_w(xyz(x) + out * touch.normal, x.w);
    touch.start_distance += out;
  }
  const double keep = min_of(rules.kept.thickness, touch.start_distance);
  const double at_end = touch.start_distance - dot(touch.normal, touch.moved);
  return {touch.normal, (1 / h) * touch.moved, (keep - at_end) / h, 1};
}

/// What a relative velocity lacks of a bound: across the surface up to `least`, and along it all.
ATELIER_HOST_DEVICE inline Vec3d lacking_velocity(Vec3d relative, Vec3d normal, double least) {
  return least * normal - relative;
}

/// The same of a particle's velocity and a bound by the body.
ATELIER_HOST_DEVICE inline Vec3d lacking_velocity(const VelocityBound& bound, Vec3d v) {
  return lacking_velocity(v - bound.moves, bound.normal,
                          bound.least - dot(bound.normal, bound.moves));
}

/// The impulse of a bound on a particle of `mass` kg that has the velocity `v` with the impulse
/// `before`: the one in the cone of `friction` that comes nearest to holding it.
ATELIER_HOST_DEVICE inline Vec3d bound_impulse(const VelocityBound& bound, Vec3d before,
                                               double mass, Vec3d v, double friction) {
  return coulomb_impulse(before + mass * lacking_velocity(bound, v), bound.normal, friction);
}

/// For searches that ask the body's tree.
struct NoCandidates {
  ATELIER_HOST_DEVICE FaceChoice<double> operator()(const Passage<double>& /*way*/) const {
    return {};
  }
};

/// True for a particle so fast on a way that it may meet another surface than that of its contact.
ATELIER_HOST_DEVICE inline bool is_looked_at_again(const Passage<double>& way,
                                                   const BoundRules& rules) {
  return squared_norm(way.p1 - way.p0) >= rules.wide.thickness * rules.wide.thickness;
}

/// True for a bound that lies across the one that a particle of velocity `v` has already, and that
/// it would pass.
ATELIER_HOST_DEVICE inline bool lies_across(const VelocityBound& bound, const VelocityBound& has,
                                            Vec3d v) {
  constexpr double kAcross = 0.5;  // cosine of the angle between two surfaces, at most
  return bound.holds != 0 && dot(lacking_velocity(bound, v), bound.normal) > 0 &&
         dot(bound.normal, has.normal) < kAcross;
}

/// Turns of a particle's two contacts with the body in a sweep.
constexpr int kBodyTurns = 4;
/// Times as many iterations has a substep in which parts of the body pinch cloth: what pulls there
/// on particles that two surfaces push at is far from known by then, and a substep that ends with
/// it throws them the further, substep by substep, until the cloth tears.
constexpr int kPinchedIterations = 3;
/// True before the iterations of a substep, of `all` usual ones, in which second contacts are
/// looked for: where the cloth pulls by then.
inline bool looks_across(int k, int all) {
  return k > 0 && (k == all / 4 || k == all / 2 || k % all == 0);
}

/// True for a particle of `mass` kg that contact holds gently (contact_impulses.h), where the
/// diagonal of the constant matrix is `resists` kg.
inline bool is_held_gently(double resists, double mass) {
  constexpr double kMostOverMass = 3e4;
  return resists > kMostOverMass * mass;
}

}  // namespace atelier
