#pragma once

#include "simulation/self_contact_math.h"

namespace atelier {

/// How far around its flight a primitive's pairs are looked for: boxes inflated by this much meet
/// where the primitives may come nearer than the gap. `slack`: of its particles.
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

/// Where a particle, an edge or a face (swept_box) flies.
template <class T>
ATELIER_HOST_DEVICE inline Box<T> flight_box(const SelfView<T>& cloth, int i) {
  Box<T> box = empty_box<T>();
  grow(box, xyz(cloth.surface.start[i]));
  grow(box, xyz(cloth.surface.end[i]));
  return box;
}
template <class T>
ATELIER_HOST_DEVICE inline Box<T> flight_box(const SelfView<T>& cloth, const ClothEdge& e) {
  return united(flight_box(cloth, e.a), flight_box(cloth, e.b));
}

template <class T>
ATELIER_HOST_DEVICE inline Box<T> box_now(const BodyView<T>& surface, int face) {
  const FaceCorners<T> t = corners_at(surface, face, T(0));
  Box<T> box{t.a, t.a};
  grow(box, t.b);
  grow(box, t.c);
  return box;
}

/// Calls `found(pair)` if particle `i` may meet the face, which it is no corner of, within the
/// flight.
template <class T, class Found>
ATELIER_HOST_DEVICE inline void offer_face(const SelfView<T>& cloth, int i, int face,
                                           const SelfRule<T>& rule, const Found& found) {
  const FaceIndices f = cloth.surface.faces[face];
  const Vec3<T> x = xyz(cloth.surface.start[i]);
  const Vec3<T> v = flight(cloth, i);
  const FaceCorners<T> t = corners_at(cloth.surface, face, T(0));
  const T squared = squared_norm(x - weighted(t, nearest_on_triangle(x, t)));
  const T motion =
      max_of(squared_norm(v - flight(cloth, f.a)),
             max_of(squared_norm(v - flight(cloth, f.b)), squared_norm(v - flight(cloth, f.c))));
  const T near =
      rule.thickness + slack_of(cloth, i, rule) + face_slack(cloth, f, rule) + std::sqrt(motion);
  if (squared > near * near) {
    return;
  }
  const FaceCorners<T> r{xyz(cloth.rest[f.a]), xyz(cloth.rest[f.b]), xyz(cloth.rest[f.c])};
  const Vec3<T> p = xyz(cloth.rest[i]);
  const T apart = same_layer(cloth, i, f.a)
                      ? T(0.9) * norm(p - weighted(r, nearest_on_triangle(p, r)))
                      : rule.thickness;
  found(SelfPair<T>{i, face, min_of(rule.thickness, apart)});
}

/// Calls `found(pair)` if edges `e` < `o`, which share no particle, may meet within the flight.
template <class T, class Found>
ATELIER_HOST_DEVICE inline void offer_edge(const SelfView<T>& cloth, int e, int o,
                                           const SelfRule<T>& rule, const Found& found) {
  const ClothEdge edge = cloth.edges[e];
  const ClothEdge other = cloth.edges[o];
  const Vec3<T> p = xyz(cloth.surface.start[edge.a]);
  const Vec3<T> q = xyz(cloth.surface.start[edge.b]);
  const Vec3<T> r = xyz(cloth.surface.start[other.a]);
  const Vec3<T> s = xyz(cloth.surface.start[other.b]);
  const SegmentShares<T> near = nearest_on_segments(p, q, r, s);
  const T squared = squared_norm(between(p, q, near.s) - between(r, s, near.t));
  const Vec3<T> vp = flight(cloth, edge.a);
  const Vec3<T> vq = flight(cloth, edge.b);
  const Vec3<T> vr = flight(cloth, other.a);
  const Vec3<T> vs = flight(cloth, other.b);
  const T motion = max_of(max_of(squared_norm(vp - vr), squared_norm(vp - vs)),
                          max_of(squared_norm(vq - vr), squared_norm(vq - vs)));
  const T within = rule.thickness + edge_slack(cloth, edge, rule) + edge_slack(cloth, other, rule) +
                   std::sqrt(motion);
  if (squared > within * within) {
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

/// True if edge `e` passes through a face, with which it shares no particle, where the search is.
template <class T>
ATELIER_HOST_DEVICE inline bool crosses_now(const SelfView<T>& cloth, int e, int face) {
  const ClothEdge edge = cloth.edges[e];
  return crosses(xyz(cloth.surface.start[edge.a]), xyz(cloth.surface.start[edge.b]),
                 corners_at(cloth.surface, face, T(0)));
}

/// Calls `found(pair)` for every face that particle `i` may meet. The tree's boxes hold the faces'
/// flights, inflated by their search margin. This and the next look through a tree, as the CPU
/// does; CUDA goes through groups (cuda_self_search.cuh).
template <class T, class Found>
ATELIER_HOST_DEVICE inline void collect_faces(const SelfView<T>& cloth, int i,
                                              const SelfRule<T>& rule, const Found& found) {
  const Box<T> query =
      inflated(flight_box(cloth, i), search_margin(rule, slack_of(cloth, i, rule)));
  visit_tree(cloth.surface.nodes, query, [&](int face) {
    const FaceIndices f = cloth.surface.faces[face];
    if (f.a != i && f.b != i && f.c != i) {
      offer_face(cloth, i, face, rule, found);
    }
  });
}

/// Calls `found(pair)` for every edge that edge `e` may meet (each pair once, by the lower index)
/// and `crossing(face)` for every face that it passes through now.
template <class T, class Found, class Crossing>
ATELIER_HOST_DEVICE inline void collect_edges(const SelfView<T>& cloth, int e,
                                              const SelfRule<T>& rule, const Found& found,
                                              const Crossing& crossing) {
  const ClothEdge edge = cloth.edges[e];
  const Box<T> query =
      inflated(flight_box(cloth, edge), search_margin(rule, edge_slack(cloth, edge, rule)));
  Box<T> now = empty_box<T>();
  grow(now, xyz(cloth.surface.start[edge.a]));
  grow(now, xyz(cloth.surface.start[edge.b]));
  visit_tree(cloth.surface.nodes, query, [&](int face) {
    const FaceIndices f = cloth.surface.faces[face];
    const bool a_in = f.a == edge.a || f.b == edge.a || f.c == edge.a;
    const bool b_in = f.a == edge.b || f.b == edge.b || f.c == edge.b;
    if (!a_in && !b_in && overlap(now, box_now(cloth.surface, face)) &&
        crosses_now(cloth, e, face)) {
      crossing(face);
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
      const Box<T> swept =
          inflated(flight_box(cloth, other), search_margin(rule, edge_slack(cloth, other, rule)));
      if (overlap(query, swept)) {
        offer_edge(cloth, e, o, rule, found);
      }
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
