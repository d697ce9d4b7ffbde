#pragma once

#include "simulation/self_contact_math.h"

namespace atelier {

/// Calls `found(pair)` for every face that particle `i` may meet. The tree's boxes hold the faces'
/// flights, inflated by what their corners' slack exceeds the rule's.
template <class T, class Found>
ATELIER_HOST_DEVICE inline void collect_faces(const SelfView<T>& cloth, int i,
                                              const SelfRule<T>& rule, const Found& found) {
  const Vec3<T> x = xyz(cloth.surface.start[i]);
  const Vec3<T> v = flight(cloth, i);
  Box<T> box{x, x};
  grow(box, x + v);
  const T own = rule.thickness + slack_of(cloth, i, rule);
  visit_tree(cloth.surface.nodes, inflated(box, own + rule.slack), [&](int face) {
    const FaceIndices f = cloth.surface.faces[face];
    if (f.a == i || f.b == i || f.c == i) {
      return;
    }
    const T reach = own + max_of(slack_of(cloth, f.a, rule),
                                 max_of(slack_of(cloth, f.b, rule), slack_of(cloth, f.c, rule)));
    const FaceCorners<T> t = corners_at(cloth.surface, face, T(0));
    const T squared = squared_norm(x - weighted(t, nearest_on_triangle(x, t)));
    const T motion =
        max_of(squared_norm(v - flight(cloth, f.a)),
               max_of(squared_norm(v - flight(cloth, f.b)), squared_norm(v - flight(cloth, f.c))));
    const T near = reach + std::sqrt(motion);
    if (squared > near * near) {
      return;
    }
    const FaceCorners<T> r{xyz(cloth.rest[f.a]), xyz(cloth.rest[f.b]), xyz(cloth.rest[f.c])};
    const Vec3<T> p = xyz(cloth.rest[i]);
    const T apart = same_layer(cloth, i, f.a)
                        ? T(0.9) * norm(p - weighted(r, nearest_on_triangle(p, r)))
                        : rule.thickness;
    found(SelfPair<T>{i, face, min_of(rule.thickness, apart)});
  });
}

/// Calls `found(pair)` for every edge that edge `e` may meet (each pair once, by the lower index)
/// and `crossing(face)` for every face that it passes through now.
template <class T, class Found, class Crossing>
ATELIER_HOST_DEVICE inline void collect_edges(const SelfView<T>& cloth, int e,
                                              const SelfRule<T>& rule, const Found& found,
                                              const Crossing& crossing) {
  const ClothEdge edge = cloth.edges[e];
  const Vec3<T> p = xyz(cloth.surface.start[edge.a]);
  const Vec3<T> q = xyz(cloth.surface.start[edge.b]);
  const Vec3<T> vp = flight(cloth, edge.a);
  const Vec3<T> vq = flight(cloth, edge.b);
  Box<T> box{p, p};
  grow(box, q);
  grow(box, p + vp);
  grow(box, q + vq);
  const T own =
      rule.thickness + max_of(slack_of(cloth, edge.a, rule), slack_of(cloth, edge.b, rule));
  const Box<T> query = inflated(box, own + rule.slack);
  Box<T> now{p, p};
  grow(now, q);
  visit_tree(cloth.surface.nodes, query, [&](int face) {
    const FaceIndices f = cloth.surface.faces[face];
    const bool a_in = f.a == edge.a || f.b == edge.a || f.c == edge.a;
    const bool b_in = f.a == edge.b || f.b == edge.b || f.c == edge.b;
    if (!a_in && !b_in) {
      const FaceCorners<T> t = corners_at(cloth.surface, face, T(0));
      Box<T> around{t.a, t.a};
      grow(around, t.b);
      grow(around, t.c);
      if (overlap(now, around) && crosses(p, q, t)) {
        crossing(face);
      }
    }
    for (int k = 0; k < 3; ++k) {
      const int o = cloth.face_edges[3 * face + k];
      if (o <= e) {
        continue;
      }
      const ClothEdge other = cloth.edges[o];
      if (other.a == edge.a || other.a == edge.b || other.b == edge.a || other.b == edge.b) {
        continue;
      }
      const Vec3<T> r = xyz(cloth.surface.start[other.a]);
      const Vec3<T> s = xyz(cloth.surface.start[other.b]);
      Box<T> swept{r, r};
      grow(swept, s);
      grow(swept, xyz(cloth.surface.end[other.a]));
      grow(swept, xyz(cloth.surface.end[other.b]));
      const T slack = max_of(slack_of(cloth, other.a, rule), slack_of(cloth, other.b, rule));
      if (!overlap(query, inflated(swept, slack - rule.slack))) {
        continue;
      }
      const SegmentShares<T> near = nearest_on_segments(p, q, r, s);
      const T squared = squared_norm(between(p, q, near.s) - between(r, s, near.t));
      const Vec3<T> vr = flight(cloth, other.a);
      const Vec3<T> vs = flight(cloth, other.b);
      const T motion = max_of(max_of(squared_norm(vp - vr), squared_norm(vp - vs)),
                              max_of(squared_norm(vq - vr), squared_norm(vq - vs)));
      const T within = own + slack + std::sqrt(motion);
      if (squared > within * within) {
        continue;
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
  });
}

/// True if a particle left the flight of the list's search too far: `age` is the time since, 1 at
/// the list's end.
template <class T>
ATELIER_HOST_DEVICE inline bool left_flight(const SelfView<T>& cloth, int i, Vec3<T> x, T age,
                                            const SelfRule<T>& rule) {
  const Vec3<T> away = x - xyz(cloth.surface.start[i]) - age * flight(cloth, i);
  const T slack = slack_of(cloth, i, rule);
  return squared_norm(away) > slack * slack;
}

}  // namespace atelier
