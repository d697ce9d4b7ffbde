#pragma once

#include <type_traits>

#include "simulation/contact/self_contact_math.h"

namespace atelier {

/// How far around its swept motion a primitive's pairs are looked for: boxes inflated by this much
/// meet where the primitives may come nearer than the gap. `slack`: of its particles.
template <class T>
ATELIER_HOST_DEVICE inline T search_margin(const SelfRule<T>& rule, T slack) {
  return T(0.5) * rule.thickness + slack;
}
template <class T>
ATELIER_HOST_DEVICE inline T edge_slack(const SelfView<T>& cloth, const ClothEdge& e,
                                        const SelfRule<T>& rule) {
  return max_of(slack_of(cloth, e.a, rule), slack_of(cloth, e.b, rule));
}
template <class T>
ATELIER_HOST_DEVICE inline T face_slack(const SelfView<T>& cloth, const FaceIndices& f,
                                        const SelfRule<T>& rule) {
  return max_of(slack_of(cloth, f.a, rule),
                max_of(slack_of(cloth, f.b, rule), slack_of(cloth, f.c, rule)));
}

/// Where a particle, an edge or a face flies from now on.
template <class T>
ATELIER_HOST_DEVICE inline Box<T> swept_bound(const SelfView<T>& cloth, int i) {
  const FlyingPoint<T> p = flying(cloth, i);
  Box<T> box = empty_box<T>();
  grow(box, p.at);
  grow(box, p.at + p.on);
  return box;
}
template <class T>
ATELIER_HOST_DEVICE inline Box<T> swept_bound(const SelfView<T>& cloth, const ClothEdge& e) {
  return united(swept_bound(cloth, e.a), swept_bound(cloth, e.b));
}
template <class T>
ATELIER_HOST_DEVICE inline Box<T> swept_bound(const SelfView<T>& cloth, const FaceIndices& f) {
  return united(united(swept_bound(cloth, f.a), swept_bound(cloth, f.b)), swept_bound(cloth, f.c));
}

/// Calls `found(pair)` if particle `i` may meet the face, which it is no corner of, within the
/// swept motion.
template <class T, class Found>
ATELIER_HOST_DEVICE inline void offer_face(const SelfView<T>& cloth, int i, int face,
                                           const SelfRule<T>& rule, const Found& found) {
  const FaceIndices f = cloth.surface.faces[face];
  const FlyingPoint<T> p = flying(cloth, i);
  const FlyingPoint<T> a = flying(cloth, f.a);
  const FlyingPoint<T> b = flying(cloth, f.b);
  const FlyingPoint<T> c = flying(cloth, f.c);
  const FaceCorners<T> t{a.at, b.at, c.at};
  const T squared = squared_norm(p.at - weighted(t, nearest_on_triangle(p.at, t)));
  const T motion = max_of(squared_norm(p.on - a.on),
                          max_of(squared_norm(p.on - b.on), squared_norm(p.on - c.on)));
  const T near =
      rule.thickness + slack_of(cloth, i, rule) + face_slack(cloth, f, rule) + std::sqrt(motion);
  if (squared > near * near) {
    return;
  }
  const FaceCorners<T> r{xyz(cloth.rest[f.a]), xyz(cloth.rest[f.b]), xyz(cloth.rest[f.c])};
  const Vec3<T> flat = xyz(cloth.rest[i]);
  const T apart = same_layer(cloth, i, f.a)
                      ? T(0.9) * norm(flat - weighted(r, nearest_on_triangle(flat, r)))
                      : rule.thickness;
  found(SelfPair<T>{i, face, min_of(rule.thickness, apart)});
}

/// True if the segments p q and r s are more than `within` apart along the line through their
/// midpoints: most pairs of edges whose boxes meet are, and that is soon found.
template <class T>
ATELIER_HOST_DEVICE inline bool midpoints_part(Vec3<T> p, Vec3<T> q, Vec3<T> r, Vec3<T> s,
                                               T within) {
  const Vec3<T> between_middles = T(0.5) * ((r + s) - (p + q));
  const T squared = squared_norm(between_middles);
  const T reach =
      T(0.5) * (std::abs(dot(q - p, between_middles)) + std::abs(dot(s - r, between_middles)));
  const T gap = squared - reach;  // both times the distance of the midpoints
  return gap > T(0) && gap * gap > within * within * squared;
}

/// Calls `found(pair)` if edges `e` < `o`, which share no particle, may meet within the swept
/// motion.
template <class T, class Found>
ATELIER_HOST_DEVICE inline void offer_edge(const SelfView<T>& cloth, int e, int o,
                                           const SelfRule<T>& rule, const Found& found) {
  const ClothEdge edge = cloth.edges[e];
  const ClothEdge other = cloth.edges[o];
  const FlyingPoint<T> p = flying(cloth, edge.a);
  const FlyingPoint<T> q = flying(cloth, edge.b);
  const FlyingPoint<T> r = flying(cloth, other.a);
  const FlyingPoint<T> s = flying(cloth, other.b);
  const T motion = max_of(max_of(squared_norm(p.on - r.on), squared_norm(p.on - s.on)),
                          max_of(squared_norm(q.on - r.on), squared_norm(q.on - s.on)));
  const T within = rule.thickness + edge_slack(cloth, edge, rule) + edge_slack(cloth, other, rule) +
                   std::sqrt(motion);
  if (midpoints_part(p.at, q.at, r.at, s.at, within)) {
    return;
  }
  const SegmentShares<T> near = nearest_on_segments(p.at, q.at, r.at, s.at);
  if (squared_norm(between(p.at, q.at, near.s) - between(r.at, s.at, near.t)) > within * within) {
    return;
  }
  T apart = rule.thickness;
  if (same_layer(cloth, edge.a, other.a)) {
    const Vec3<T> rp = xyz(cloth.rest[edge.a]);
    const Vec3<T> rq = xyz(cloth.rest[edge.b]);
    const Vec3<T> rr = xyz(cloth.rest[other.a]);
    const Vec3<T> rs = xyz(cloth.rest[other.b]);
    const SegmentShares<T> flat = nearest_on_segments(rp, rq, rr, rs);
    apart = T(0.9) * norm(between(rp, rq, flat.s) - between(rr, rs, flat.t));
  }
  found(SelfPair<T>{e, o, min_of(rule.thickness, apart)});
}

/// Box over an edge or a face where `load` has its particles.
template <class Load>
ATELIER_HOST_DEVICE inline auto box_at(const ClothEdge& edge, const Load& load) {
  auto box = empty_box<std::decay_t<decltype(load(0).x)>>();
  grow(box, xyz(load(edge.a)));
  grow(box, xyz(load(edge.b)));
  return box;
}
template <class Load>
ATELIER_HOST_DEVICE inline auto box_at(const FaceIndices& face, const Load& load) {
  auto box = empty_box<std::decay_t<decltype(load(0).x)>>();
  grow(box, xyz(load(face.a)));
  grow(box, xyz(load(face.b)));
  grow(box, xyz(load(face.c)));
  return box;
}

/// True if an edge passes through a face, with which it shares no particle, where `load` has them.
template <class Load>
ATELIER_HOST_DEVICE inline bool crosses_at(const ClothEdge& edge, const FaceIndices& face,
                                           const Load& load) {
  using T = std::decay_t<decltype(load(0).x)>;
  return crosses(xyz(load(edge.a)), xyz(load(edge.b)),
                 FaceCorners<T>{xyz(load(face.a)), xyz(load(face.b)), xyz(load(face.c))});
}

/// How old a list's search is, and how far it looked ahead, in substeps.
struct SearchAge {
  int age, ahead;
};

/// A new swept motion for a particle that left its own, or may soon, and more slack: then true.
/// `origin`: where the substep began.
template <class T>
ATELIER_HOST_DEVICE inline bool renew_swept_bound(SearchAge search, Vec3<T> x, Vec3<T> origin,
                                                  Vec4<T>& start, Vec4<T>& end, T& slack) {
  const auto [age, ahead] = search;
  const T share = static_cast<T>(age) / static_cast<T>(ahead);
  const T away = norm(x - xyz(start) - share * (xyz(end) - xyz(start)));
  if (!(away > T(kSelfNearly) * slack)) {
    return false;
  }
  const Vec3<T> moved = x - origin;
  start = with_w(origin - static_cast<T>(age - 1) * moved, start.w);
  end = with_w(xyz(start) + static_cast<T>(ahead) * moved, end.w);
  slack = max_of(slack, T(2) * away);
  return true;
}

/// True if a particle left the swept motion of the list's search too far: `age` is the time since,
/// 1 at the list's end.
template <class T>
ATELIER_HOST_DEVICE inline bool left_swept_bound(const SelfView<T>& cloth, int i, Vec3<T> x, T age,
                                                 const SelfRule<T>& rule) {
  const Vec3<T> away = x - xyz(cloth.surface.start[i]) - age * swept_motion(cloth, i);
  const T slack = slack_of(cloth, i, rule);
  return squared_norm(away) > slack * slack;
}

}  // namespace atelier
