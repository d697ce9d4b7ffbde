#pragma once

#include "simulation/contact/body_surface_math.h"

namespace atelier {

/// A particle touching the body.
template <class T>
struct BodyTouch {
  Vec3<T> normal;  ///< outwards, unit
  Vec3<T> point;   ///< on the body at the end of the substep
  Vec3<T> moved;   ///< how the body's point moved in the substep
  T distance;      ///< of the particle at the end, along the normal
  T start_distance;
  bool valid;
};

template <class T>
ATELIER_HOST_DEVICE inline BodyTouch<T> touch_at(const BodyView<T>& body, int face,
                                                 Vec3<T> barycentric, Vec3<T> normal,
                                                 const Passage<T>& way) {
  BodyTouch<T> out;
  const Vec3<T> p0 = weighted(corners_at(body, face, way.t0), barycentric);
  const Vec3<T> p1 = weighted(corners_at(body, face, way.t1), barycentric);
  out.normal = normal;
  out.point = p1;
  out.moved = p1 - p0;
  out.distance = dot(normal, way.p1 - p1);
  out.start_distance = dot(normal, way.p0 - p0);
  out.valid = true;
  return out;
}

/// Contact of one particle with the nearest face found, if it is nearer than `thickness`.
template <class T>
ATELIER_HOST_DEVICE inline BodyTouch<T> touch_nearest(const BodyView<T>& body,
                                                      const FaceOffer<T>& best,
                                                      const Passage<T>& way, T thickness) {
  BodyTouch<T> out;
  out.valid = false;
  if (best.face < 0) {
    return out;
  }
  const T distance = std::sqrt(best.squared_distance);
  if (best.side >= T(0) && distance >= thickness) {
    return out;
  }
  const FaceCorners<T> t = corners_at(body, best.face, way.t1);
  Vec3<T> normal = cross(t.b - t.a, t.c - t.a);
  normal = (T(1) / norm(normal)) * normal;
  const Vec3<T> b = best.barycentric;
  const bool inside_face = b.x > T(0) && b.y > T(0) && b.z > T(0);
  if (!inside_face && distance > T(1e-5)) {
    const Vec3<T> d = way.p1 - weighted(t, b);
    normal = (best.side >= T(0) ? T(1) / distance : T(-1) / distance) * d;
  }
  return touch_at(body, best.face, b, normal, way);
}

/// Parameters of contact with the body.
template <class T>
struct BodyContactRule {
  T thickness;    ///< m
  T friction;     ///< Coulomb coefficient
  T reach;        ///< m, how deep an overlap may be and still be found
  T old_overlap;  ///< m at most taken off an overlap that was there before, per substep
};

/// The body in a substep, from t0 to t1 of the frame, and what contact with it obeys.
template <class T>
struct BodySubstep {
  const BodyView<T>& body;
  BodyContactRule<T> rule;
  T t0, t1;
};

/// A particle that meets the body in a substep.
template <class T>
struct BodyParticle {
  Vec4<T> x;
  Vec4<T> start;  ///< of the substep; moves along with an overlap that was there before, so that
                  ///< it does not become speed
  Vec4<T> held;   ///< over the iterations of a substep: the tangential correction so far (xyz) and
                  ///< the normal one (w)
  Vec3<T> moved;  ///< how the body moved in the substep where the particle touches it
  Vec3<T> touched = {T(0), T(0), T(0)};  ///< normal of the first touch
};

template <class T>
ATELIER_HOST_DEVICE inline Passage<T> way_of(const BodyParticle<T>& p, const BodySubstep<T>& step) {
  return {xyz(p.start), xyz(p.x), step.t0, step.t1};
}

/// Moves a particle out of the body and lets friction hold it (Coulomb: exact stick inside the
/// cone). The friction of the substep's earlier iterations is projected onto the cone again in
/// each, also where the particle lies at its distance already: else directions of slips on the way
/// to the solution stayed in it.
template <class T>
ATELIER_HOST_DEVICE inline void resolve_touch(BodyParticle<T>& p, const BodyTouch<T>& touch,
                                              const BodyContactRule<T>& rule, bool with_friction) {
  const T wanted = rule.thickness - touch.distance;
  const Vec3<T> n = touch.normal;
  if (wanted > T(0)) {
    const T fresh = max_of(T(0), touch.start_distance - touch.distance);
    const T correction = min_of(wanted, fresh + rule.old_overlap);
    const T old = max_of(T(0), correction - fresh);
    p.x = with_w(xyz(p.x) + correction * n, p.x.w);
    p.start = with_w(xyz(p.start) + old * n, p.start.w);
    p.held.w += with_friction ? correction - old : T(0);
  }
  if (!with_friction || !(p.held.w > T(0))) {
    return;
  }
  const Vec3<T> relative = (xyz(p.x) - xyz(p.start)) - touch.moved;
  const Vec3<T> slip = relative - dot(relative, n) * n;
  Vec3<T> hold = xyz(p.held) - slip;
  const T size = norm(hold);
  const T most = rule.friction * p.held.w;
  if (size > most) {
    hold = (most / size) * hold;
  }
  p.x = with_w(xyz(p.x) + (hold - xyz(p.held)), p.x.w);
  p.held = with_w(hold, p.held.w);
}

/// Acts on the choice: first what would be passed through, else the nearest face. Returns true if
/// it touched; then the nearest face is to be looked for once more (a corner between two surfaces)
/// and given to touch_again.
template <class T>
ATELIER_HOST_DEVICE inline bool touch_choice(BodyParticle<T>& p, const BodySubstep<T>& step,
                                             const FaceChoice<T>& choice) {
  const BodyContactRule<T>& rule = step.rule;
  BodyTouch<T> touch;
  if (choice.first.time <= T(1)) {
    const int face = choice.first.face;
    const FaceCorners<T> t = corners_at(step.body, face, step.t1);
    Vec3<T> normal = cross(t.b - t.a, t.c - t.a);
    normal = (T(1) / norm(normal)) * normal;
    touch = touch_at(step.body, face, choice.first.hit, normal, way_of(p, step));
  } else {
    // Whom an earlier iteration moved out lies at the body's distance, but for rounding.
    const T near = p.held.w > T(0) ? T(1.001) * rule.thickness : rule.thickness;
    touch = touch_nearest(step.body, choice.nearest, way_of(p, step), near);
  }
  if (touch.valid) {
    p.moved = touch.moved;
    p.touched = touch.normal;
    resolve_touch(p, touch, rule, true);
  }
  return touch.valid;
}

template <class T>
ATELIER_HOST_DEVICE inline void touch_again(BodyParticle<T>& p, const BodySubstep<T>& step,
                                            const FaceOffer<T>& nearest) {
  BodyContactRule<T> rule = step.rule;
  const BodyTouch<T> touch = touch_nearest(step.body, nearest, way_of(p, step), rule.thickness);
  if (touch.valid) {
    // Between two surfaces that face each other there may be no room for both distances: the
    // particle goes where it is as far from the one as from the other.
    const T against = max_of(T(0), -dot(touch.normal, p.touched));
    const T wanted = (rule.thickness - touch.distance) / (T(1) + against);
    rule.thickness = touch.distance + wanted;
    resolve_touch(p, touch, rule, false);
  }
}

/// Faces that a particle may meet during a frame, at most.
constexpr int kBodyCandidates = 32;
constexpr int kSearchTree = -1;  ///< instead of a count: too many, ask the tree in every substep
constexpr int kSearchDeep = -2;  ///< it starts inside: ask the tree as deep as `reach`
/// It starts inside, but nearest to a piece of the body that lies inside too (where limbs overlap)
/// and looks at it from its front: ask for the way out.
constexpr int kSearchBuried = -3;

/// Contact candidates of a particle in a frame. `gap` and `from` are renewed whenever the
/// candidates are tested: a particle far from them is not tested again for as long as it cannot
/// have come near.
template <class T>
struct BodyOutlook {
  T slack;  ///< all this holds while the particle is no further than this from its free flight [m]
  T gap;    ///< no candidate is met at time t while t speed + |deviation - from| is less than this;
            ///< of the buried how far the way out may be
  T speed;  ///< largest motion relative to a candidate in the frame
  Vec3<T> from;  ///< deviation from the free flight at which the gap was found
  int count;     ///< of candidates, or kSearchTree or kSearchDeep
};

/// How a particle flies through a frame where nothing holds it.
template <class T>
struct FreeFlight {
  Vec3<T> start;
  Vec3<T> flight;  ///< of the whole frame [m]
};

/// How far a particle may leave its free flight in a frame: what gravity adds, and a margin for
/// what pulls at it [m]. Further than that, and the tree is asked.
template <class T>
ATELIER_HOST_DEVICE inline T expected_deviation(Vec3<T> acceleration, T frame) {
  const T margin = T(0.003);
  return T(0.5) * norm(acceleration) * frame * frame + margin;
}

/// True if `x`, which is `distance` from the nearest face at the start of the frame, lies behind
/// it.
template <class T, class Team>
ATELIER_HOST_DEVICE inline bool lies_behind_nearest(const BodyView<T>& body, Vec3<T> x, T distance,
                                                    const Team& team) {
  const int face = face_that_knows_the_side(body, x, T(0), as_near(distance * distance), team);
  return face >= 0 && offer_of(body, face, standing(x, T(0)), false).side < T(0);
}

/// Collects the faces that a particle may meet while it flies through the frame, give or take
/// `slack`: every face whose distance now is below their relative motion, the slack and the
/// thickness.
template <class T, class Team>
ATELIER_HOST_DEVICE inline BodyOutlook<T> collect_candidates(const BodyView<T>& body,
                                                             const FreeFlight<T>& free, T slack,
                                                             const BodyContactRule<T>& rule,
                                                             int* candidates, const Team& team) {
  const Vec3<T> x = free.start;
  const Vec3<T> flight = free.flight;
  BodyOutlook<T> out{slack, T(1e15), T(0), {}, 0};
  T least = T(1e15);
  int count = 0;
  const T radius = max_of(rule.reach, norm(flight) + slack + rule.thickness);
  team.visit(body, inflated(Box<T>{x, x}, radius), [&](int face) {
    const FaceOffer<T> offer = offer_of(body, face, standing(x, T(0)), false);
    if (offer.face >= 0) {
      least = min_of(least, offer.squared_distance);
    }
    const FaceIndices f = body.faces[face];
    const T a = squared_norm(flight - (xyz(body.end[f.a]) - xyz(body.start[f.a])));
    const T b = squared_norm(flight - (xyz(body.end[f.b]) - xyz(body.start[f.b])));
    const T c = squared_norm(flight - (xyz(body.end[f.c]) - xyz(body.start[f.c])));
    const T relative = std::sqrt(max_of(a, max_of(b, c)));
    const T gap = std::sqrt(offer.squared_distance) - rule.thickness;
    if (gap <= relative + slack) {
      const int at = team.place(count);
      if (at < kBodyCandidates) {
        candidates[at] = face;
      }
      out.gap = min_of(out.gap, gap);
      out.speed = max_of(out.speed, relative);
    }
  });
  out.count = team.length(count);
  out.gap = team.least(out.gap);
  out.speed = team.most(out.speed);
  least = team.least(least);
  bool inside = false;
  bool buried = false;
  if (least <= rule.reach * rule.reach) {
    inside = lies_behind_nearest(body, x, std::sqrt(least), team);
    if (!inside && times_inside(body, x, T(0), team) > 0) {
      const FaceOffer<T> way_out = nearest_way_out(body, x, T(0), rule.reach, team);
      buried = way_out.face >= 0;
      out.gap = buried ? std::sqrt(way_out.squared_distance) + out.speed + slack : out.gap;
    }
  }
  out.count = buried                        ? kSearchBuried
              : inside                      ? kSearchDeep
              : out.count > kBodyCandidates ? kSearchTree
                                            : out.count;
  return out;
}

/// True for a particle that began the frame inside the body.
template <class T>
ATELIER_HOST_DEVICE inline bool began_inside(const BodyOutlook<T>& outlook) {
  return outlook.count == kSearchDeep || outlook.count == kSearchBuried;
}

/// How a particle finds its contacts in a substep that ends at time t1 of the frame.
enum class BodySearch { Nothing, Candidates, Tree, DeepTree, WayOut };

template <class T>
ATELIER_HOST_DEVICE inline BodySearch body_search(const BodyOutlook<T>& outlook, Vec3<T> x,
                                                  const FreeFlight<T>& free, T t1) {
  if (outlook.count == kSearchDeep) {
    return BodySearch::DeepTree;
  }
  if (outlook.count == kSearchBuried) {
    return BodySearch::WayOut;
  }
  const Vec3<T> away = x - free.start - t1 * free.flight;
  if (squared_norm(away) > outlook.slack * outlook.slack) {
    return BodySearch::Tree;
  }
  const T room = outlook.gap - t1 * outlook.speed;
  if (outlook.count == 0 || (room > T(0) && squared_norm(away - outlook.from) < room * room)) {
    return BodySearch::Nothing;
  }
  return outlook.count == kSearchTree ? BodySearch::Tree : BodySearch::Candidates;
}

/// The nearest face and the first face passed among `candidates`; the choice does not depend on
/// their order.
template <class T>
ATELIER_HOST_DEVICE inline FaceChoice<T> choose_candidate(const BodyView<T>& body,
                                                          const int* candidates, int count,
                                                          const Passage<T>& way, T reach,
                                                          bool swept) {
  FaceChoice<T> choice{no_offer(reach), no_offer(reach)};
  T least = reach * reach;
  bool found = false;
  for (int c = 0; c < count; ++c) {
    const FaceOffer<T> offer = offer_of(body, candidates[c], way, swept);
    if (passed_before(offer, choice.first)) {
      choice.first = offer;
    }
    if (offer.face >= 0 && offer.squared_distance <= least) {
      least = offer.squared_distance;
      found = true;
    }
  }
  if (!found || choice.first.time <= T(1)) {
    return choice;
  }
  const T near = as_near(least);
  for (int c = 0; c < count; ++c) {
    const FaceOffer<T> offer = offer_of(body, candidates[c], way, false);
    if (offer.face >= 0 && offer.squared_distance <= near &&
        knows_side_better(offer, choice.nearest)) {
      choice.nearest = offer;
    }
  }
  return choice;
}

/// Renews the outlook of a particle at `x` that does not touch what lies nearest to it.
template <class T>
ATELIER_HOST_DEVICE inline void look_out_again(BodyOutlook<T>& outlook, const FaceOffer<T>& nearest,
                                               Vec3<T> x, const FreeFlight<T>& free, T t1,
                                               const BodyContactRule<T>& rule) {
  // Slightly less than the distance: a face as near as the nearest may be nearer by rounding.
  const T distance = T(0.9999) * std::sqrt(nearest.squared_distance);
  outlook.gap = t1 * outlook.speed + distance - rule.thickness;
  outlook.from = x - free.start - t1 * free.flight;
}

/// Contact of one free particle with its candidates in a substep. `choose(way, swept)` gives the
/// choice among them (choose_candidate).
template <class T, class Choose>
ATELIER_HOST_DEVICE inline bool contact_by_candidates(BodyParticle<T>& p,
                                                      const BodySubstep<T>& step,
                                                      BodyOutlook<T>& outlook,
                                                      const FreeFlight<T>& free,
                                                      const Choose& choose) {
  const FaceChoice<T> choice = choose(way_of(p, step), true);
  if (!touch_choice(p, step, choice)) {
    look_out_again(outlook, choice.nearest, xyz(p.x), free, step.t1, step.rule);
    return false;
  }
  touch_again(p, step, choose(way_of(p, step), false).nearest);
  return true;
}

/// Contact of one free particle with the body in a substep, asking the tree.
template <class T, class Team>
ATELIER_HOST_DEVICE inline bool contact_by_tree(BodyParticle<T>& p, const BodySubstep<T>& step,
                                                const BodyOutlook<T>& outlook, BodySearch search,
                                                const Team& team) {
  const BodyView<T>& body = step.body;
  const BodyContactRule<T>& rule = step.rule;
  const T t1 = step.t1;
  if (search == BodySearch::WayOut) {
    FaceChoice<T> choice{nearest_way_out(body, xyz(p.x), t1, min_of(rule.reach, outlook.gap), team),
                         no_offer(rule.reach)};
    return touch_choice(p, step, choice);
  }
  const bool deep = search == BodySearch::DeepTree;
  Box<T> box{xyz(p.x), xyz(p.x)};
  grow(box, xyz(p.start));
  // A particle outside needs to look no deeper than what it touches or passes through.
  const Box<T> query = inflated(box, deep ? rule.reach : rule.thickness + T(1e-3));
  for (int pass = 0; pass < 2; ++pass) {
    FaceChoice<T> choice =
        choose_in_tree(body, query, way_of(p, step), rule.reach, pass == 0, team);
    // In one limb, and outside another that is nearer: that knows nothing of the first.
    if (deep && choice.first.time > T(1) && choice.nearest.side >= T(0) &&
        times_inside(body, xyz(p.x), t1, team) > 0) {
      const FaceOffer<T> way_out = nearest_way_out(body, xyz(p.x), t1, rule.reach, team);
      choice.nearest = way_out.face >= 0 ? way_out : choice.nearest;
    }
    if (pass == 0) {
      if (!touch_choice(p, step, choice)) {
        return false;
      }
    } else {
      touch_again(p, step, choice.nearest);
    }
  }
  return true;
}

/// How a particle that cloth moved meets the body.
enum class Meeting {
  Touches,  ///< as any other
  Rides,    ///< kept back: goes from where the substep began along with the body near it
  Stays,    ///< kept back: is carried by its neighbours; the body leaves it half of its distance
  Leaves    ///< the same, at last: the body asks no more than that it is outside
};

/// A particle that cloth around it keeps back from where it would go. Between body and cloth there
/// may be no room for all distances: the body's give way first, step by step, as its distance
/// pushes what it presses through other cloth; in the end none is inside. `origin`: where the
/// substep began. True if it touches.
template <class T>
ATELIER_HOST_DEVICE inline bool stay_with_body(BodyParticle<T>& p, const Vec4<T>& origin,
                                               const BodySubstep<T>& whole,
                                               const BodyOutlook<T>& outlook, Meeting meeting) {
  const BodyView<T>& body = whole.body;
  const T reach = whole.rule.reach;
  const Vec3<T> at = xyz(origin);
  if (meeting == Meeting::Rides) {
    const FaceOffer<T> nearest = choose_in_tree(body, inflated(Box<T>{at, at}, reach),
                                                standing(at, whole.t0), reach, false, AloneInTree{})
                                     .nearest;
    if (nearest.face >= 0) {
      const Vec3<T> ride = weighted(corners_at(body, nearest.face, whole.t1), nearest.barycentric) -
                           weighted(corners_at(body, nearest.face, whole.t0), nearest.barycentric);
      p.x = with_w(at + ride, p.x.w);
    }
  }
  BodySubstep<T> step = whole;
  step.rule.thickness *= meeting == Meeting::Rides   ? T(1)
                         : meeting == Meeting::Stays ? T(0.5)
                                                     : T(0.05);
  // As deep as `reach`: a carried particle may be deeper than one that moves by itself.
  const BodySearch search =
      outlook.count == kSearchBuried ? BodySearch::WayOut : BodySearch::DeepTree;
  bool touches = contact_by_tree(p, step, outlook, search, AloneInTree{});
  if (meeting == Meeting::Leaves && times_inside(body, xyz(p.x), whole.t1, AloneInTree{}) == 1) {
    // Two surfaces leave it no room: it goes half way between them.
    touches = contact_by_tree(p, whole, outlook, search, AloneInTree{});
  }
  p.moved = xyz(p.x) - at;
  return touches;
}

/// Depth of a particle inside the body at time 1, 0 outside [m].
template <class T>
ATELIER_HOST_DEVICE inline T depth_inside(const BodyView<T>& body, Vec3<T> x, T reach) {
  const FaceChoice<T> choice = choose_in_tree(body, inflated(Box<T>{x, x}, reach),
                                              standing(x, T(1)), reach, false, AloneInTree{});
  if (choice.nearest.face < 0) {
    return T(0);
  }
  if (choice.nearest.side < T(0)) {
    return std::sqrt(choice.nearest.squared_distance);
  }
  if (times_inside(body, x, T(1), AloneInTree{}) != 1) {
    return T(0);
  }
  const FaceOffer<T> way_out = nearest_way_out(body, x, T(1), reach, AloneInTree{});
  return way_out.face >= 0 ? std::sqrt(way_out.squared_distance) : T(0);
}

/// A particle that began a frame outside ends it outside: between limbs that close, a substep may
/// push a particle out of the one and deep into the other, which lets it go slowly, as it does what
/// was in it before. It is set on the surface, up to four times the reach away, and keeps its
/// velocity; so is one that began inside and is no deeper than it may come out by in a quarter of
/// the frame's `substeps` (in all of them it would strain its neighbours). Where the body overlaps
/// itself there is no outside: the way out of one limb may end in the other, no deeper than they
/// overlap. A particle that stayed near its free flight, among its candidates, passed none of them.
/// For closed bodies. Our choice.
template <class T, class Team>
ATELIER_HOST_DEVICE inline void end_outside(const BodyView<T>& body, const BodyContactRule<T>& rule,
                                            const BodyOutlook<T>& outlook,
                                            const FreeFlight<T>& free, int substeps, Vec4<T>& x,
                                            const Team& team) {
  const Vec3<T> at = xyz(x);
  const BodySearch search = body_search(outlook, at, free, T(1));
  if (search == BodySearch::Nothing || search == BodySearch::Candidates ||
      times_inside(body, at, T(1), team) != 1) {
    return;
  }
  // The outlook does not know of a particle that began deeper than the reach that it began inside.
  const bool old = began_inside(outlook) || times_inside(body, free.start, T(0), team) > 0;
  const T soon = min_of(rule.reach, T(0.25) * static_cast<T>(substeps) * rule.old_overlap);
  FaceOffer<T> way_out = nearest_way_out(body, at, T(1), old ? soon : rule.reach, team);
  if (way_out.face < 0 && !old) {
    way_out = nearest_way_out(body, at, T(1), T(4) * rule.reach, team);
  }
  if (way_out.face < 0) {
    return;
  }
  const FaceCorners<T> t = corners_at(body, way_out.face, T(1));
  const Vec3<T> normal = cross(t.b - t.a, t.c - t.a);
  const T off = T(1e-5);  // m, more than rounding
  x = with_w(weighted(t, way_out.barycentric) + (off / norm(normal)) * normal, x.w);
}

}  // namespace atelier
