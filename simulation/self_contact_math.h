#pragma once

#include <cstdint>

#include "simulation/body_contact_math.h"

namespace atelier {

/// Contact of cloth with itself and between layers: vertex against triangle and edge against edge.
///
/// Pairs that may meet are collected once a frame. In a substep a pair keeps the side on which it
/// was at the substep's start, so that however fast it moves it does not pass (a swept test against
/// the start's separating direction). Pairs are solved at once and averaged per particle (Jacobi):
/// the sums are integers of 2^-30 m, so that their order does not matter and every run gives the
/// same bits. What is crossed already is pulled apart along the gradient of the length of the
/// intersection (Volino and Magnenat-Thalmann 2006); layers know which side is outside.

/// An edge with its faces: `face[0]` owns it.
struct ClothEdge {
  int a, b;
  int face[2];      ///< -1: boundary
  int opposite[2];  ///< corner across in each face
};

/// The cloth during a frame: `surface.start` are the particles now, `surface.end` where they fly.
template <class T>
struct SelfView {
  BodyView<T> surface;
  const ClothEdge* edges;
  int edge_count;
  const int* face_edges;  ///< [3 F] edges that a face owns, or -1
  const Vec4<T>* rest;    ///< template positions: sheets that lie close there may stay close
  const int* layer;       ///< of particles, or null
  const int* tangled;     ///< of particles: 1 where a piece around it is crossed
};

template <class T>
struct SelfRule {
  T thickness;  ///< m
  T friction;
  T old_overlap;  ///< m per substep at most off an overlap that was there before
  T margin;       ///< m, added to the expected motion when looking for pairs
  T untangle;     ///< m per substep by which crossed pieces are pulled
};

constexpr int kSelfCandidates = 16;  ///< faces of a vertex, edges of an edge
constexpr int kSelfCrossings = 2;    ///< faces that an edge passes through

/// A pair that may meet: the other primitive, and the gap that it keeps.
template <class T>
struct SelfPair {
  int other;
  T gap;
};

/// The nearest pairs of one primitive.
template <class T>
struct SelfPairs {
  int count;  ///< of pairs kept
  int found;  ///< of all
  SelfPair<T> pair[kSelfCandidates];
  T distance[kSelfCandidates];
};

template <class T>
ATELIER_HOST_DEVICE inline void keep_nearest(SelfPairs<T>& pairs, int other, T gap, T distance) {
  ++pairs.found;
  int at = pairs.count;
  if (at == kSelfCandidates) {
    const bool last = distance < pairs.distance[at - 1] ||
                      (distance == pairs.distance[at - 1] && other < pairs.pair[at - 1].other);
    if (!last) {
      return;
    }
    --at;
  } else {
    ++pairs.count;
  }
  while (at > 0 && (distance < pairs.distance[at - 1] ||
                    (distance == pairs.distance[at - 1] && other < pairs.pair[at - 1].other))) {
    pairs.pair[at] = pairs.pair[at - 1];
    pairs.distance[at] = pairs.distance[at - 1];
    --at;
  }
  pairs.pair[at] = {other, gap};
  pairs.distance[at] = distance;
}

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> flight(const SelfView<T>& cloth, int i) {
  return xyz(cloth.surface.end[i]) - xyz(cloth.surface.start[i]);
}

/// Faces that particle `i` may meet in the frame.
template <class T>
ATELIER_HOST_DEVICE inline SelfPairs<T> collect_faces(const SelfView<T>& cloth, int i,
                                                      const SelfRule<T>& rule) {
  SelfPairs<T> out;
  out.count = 0;
  out.found = 0;
  const Vec3<T> x = xyz(cloth.surface.start[i]);
  const Vec3<T> v = flight(cloth, i);
  Box<T> box{x, x};
  grow(box, x + v);
  const T reach = rule.thickness + rule.margin;
  visit_tree(cloth.surface.nodes, inflated(box, reach), [&](int face) {
    const FaceIndices f = cloth.surface.faces[face];
    if (f.a == i || f.b == i || f.c == i) {
      return;
    }
    const FaceCorners<T> t = corners_at(cloth.surface, face, T(0));
    const T distance = norm(x - weighted(t, nearest_on_triangle(x, t)));
    // Each may go on while the other is stopped, so their own speeds count, not only the
    // difference.
    T motion = squared_norm(v);
    for (int k = 0; k < 3; ++k) {
      const Vec3<T> u = flight(cloth, k == 0 ? f.a : k == 1 ? f.b : f.c);
      motion = max_of(motion, max_of(squared_norm(u), squared_norm(v - u)));
    }
    if (distance > reach + std::sqrt(motion)) {
      return;
    }
    const FaceCorners<T> r{xyz(cloth.rest[f.a]), xyz(cloth.rest[f.b]), xyz(cloth.rest[f.c])};
    const Vec3<T> p = xyz(cloth.rest[i]);
    const T apart = T(0.9) * norm(p - weighted(r, nearest_on_triangle(p, r)));
    keep_nearest(out, face, min_of(rule.thickness, apart), distance);
  });
  return out;
}

/// Shares along two segments of their nearest points (Ericson 2005, 5.1.9).
template <class T>
struct SegmentShares {
  T s, t;
};
template <class T>
ATELIER_HOST_DEVICE inline SegmentShares<T> nearest_on_segments(Vec3<T> p1, Vec3<T> q1, Vec3<T> p2,
                                                                Vec3<T> q2) {
  const auto clamp = [](T v) { return v < T(0) ? T(0) : v > T(1) ? T(1) : v; };
  const Vec3<T> d1 = q1 - p1;
  const Vec3<T> d2 = q2 - p2;
  const Vec3<T> r = p1 - p2;
  const T a = dot(d1, d1);
  const T e = dot(d2, d2);
  const T f = dot(d2, r);
  const T c = dot(d1, r);
  const T b = dot(d1, d2);
  const T denominator = a * e - b * b;
  if (!(a > T(0)) || !(e > T(0))) {
    return {T(0), T(0)};
  }
  T s = denominator > T(1e-6) * a * e ? clamp((b * f - c * e) / denominator) : T(0.5);
  T t = (b * s + f) / e;
  if (t < T(0)) {
    t = T(0);
    s = clamp(-c / a);
  } else if (t > T(1)) {
    t = T(1);
    s = clamp((b - c) / a);
  }
  return {s, t};
}

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> between(Vec3<T> a, Vec3<T> b, T share) {
  return a + share * (b - a);
}

/// True if the segment p q passes through the triangle.
template <class T>
ATELIER_HOST_DEVICE inline bool crosses(Vec3<T> p, Vec3<T> q, const FaceCorners<T>& t) {
  const auto volume = [](Vec3<T> a, Vec3<T> b, Vec3<T> c, Vec3<T> d) {
    return dot(cross(b - a, c - a), d - a);
  };
  const T at_p = volume(t.a, t.b, t.c, p);
  const T at_q = volume(t.a, t.b, t.c, q);
  if (!((at_p > T(0) && at_q < T(0)) || (at_p < T(0) && at_q > T(0)))) {
    return false;
  }
  const T ab = volume(p, q, t.a, t.b);
  const T bc = volume(p, q, t.b, t.c);
  const T ca = volume(p, q, t.c, t.a);
  return (ab > T(0) && bc > T(0) && ca > T(0)) || (ab < T(0) && bc < T(0) && ca < T(0));
}

/// Edges that edge `e` may meet (each pair once, by the lower index), and the faces it crosses now.
template <class T>
struct EdgePairs {
  SelfPairs<T> edges;
  int crossing_count;
  int crossing[kSelfCrossings];
};
template <class T>
ATELIER_HOST_DEVICE inline EdgePairs<T> collect_edges(const SelfView<T>& cloth, int e,
                                                      const SelfRule<T>& rule) {
  EdgePairs<T> out;
  out.edges.count = 0;
  out.edges.found = 0;
  out.crossing_count = 0;
  const ClothEdge edge = cloth.edges[e];
  const Vec3<T> p = xyz(cloth.surface.start[edge.a]);
  const Vec3<T> q = xyz(cloth.surface.start[edge.b]);
  const Vec3<T> vp = flight(cloth, edge.a);
  const Vec3<T> vq = flight(cloth, edge.b);
  Box<T> box{p, p};
  grow(box, q);
  grow(box, p + vp);
  grow(box, q + vq);
  const T reach = rule.thickness + rule.margin;
  visit_tree(cloth.surface.nodes, inflated(box, reach), [&](int face) {
    const FaceIndices f = cloth.surface.faces[face];
    const bool a_in = f.a == edge.a || f.b == edge.a || f.c == edge.a;
    const bool b_in = f.a == edge.b || f.b == edge.b || f.c == edge.b;
    if (!a_in && !b_in && out.crossing_count < kSelfCrossings &&
        crosses(p, q, corners_at(cloth.surface, face, T(0)))) {
      out.crossing[out.crossing_count++] = face;
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
      const SegmentShares<T> near = nearest_on_segments(p, q, r, s);
      const T distance = norm(between(p, q, near.s) - between(r, s, near.t));
      const Vec3<T> vr = flight(cloth, other.a);
      const Vec3<T> vs = flight(cloth, other.b);
      const T relative = max_of(max_of(squared_norm(vp - vr), squared_norm(vp - vs)),
                                max_of(squared_norm(vq - vr), squared_norm(vq - vs)));
      const T own = max_of(max_of(squared_norm(vp), squared_norm(vq)),
                           max_of(squared_norm(vr), squared_norm(vs)));
      if (distance > reach + std::sqrt(max_of(relative, own))) {
        continue;
      }
      const Vec3<T> rp = xyz(cloth.rest[edge.a]);
      const Vec3<T> rq = xyz(cloth.rest[edge.b]);
      const Vec3<T> rr = xyz(cloth.rest[other.a]);
      const Vec3<T> rs = xyz(cloth.rest[other.b]);
      const SegmentShares<T> flat = nearest_on_segments(rp, rq, rr, rs);
      const T apart = T(0.9) * norm(between(rp, rq, flat.s) - between(rr, rs, flat.t));
      keep_nearest(out.edges, o, min_of(rule.thickness, apart), distance);
    }
  });
  return out;
}

/// Four particles of a pair with the weights of its two nearest points: their difference, first
/// minus second, is sum weight x.
template <class T>
struct PairPoints {
  int particle[4];
  T weight[4];
};

/// What a pair wants of its particles: corrections and whether it pushed at all.
template <class T>
struct PairPush {
  bool active;
  Vec3<T> correction[4];
};

/// Keeps a pair apart by `gap` along the direction it had at the substep's start. `outwards` is 0,
/// or the unit direction in which the first must lie (layers).
template <class T>
ATELIER_HOST_DEVICE inline PairPush<T> push_apart(const PairPoints<T>& pair, const Vec4<T>* x,
                                                  const Vec4<T>* start, Vec3<T> fallback,
                                                  Vec3<T> outwards, T gap,
                                                  const SelfRule<T>& rule) {
  PairPush<T> out;
  out.active = false;
  Vec3<T> now{};
  Vec3<T> before{};
  T weight = T(0);
  for (int k = 0; k < 4; ++k) {
    now += pair.weight[k] * xyz(x[k]);
    before += pair.weight[k] * xyz(start[k]);
    weight += pair.weight[k] * pair.weight[k] * x[k].w;
  }
  if (!(weight > T(0))) {
    return out;
  }
  const T distance = norm(before);
  Vec3<T> n = distance > T(1e-7) ? (T(1) / distance) * before : fallback;
  if (dot(n, outwards) < T(0)) {
    n = outwards;
  }
  const T at_start = dot(n, before);
  const T at_end = dot(n, now);
  if (!(at_end < gap)) {
    return out;
  }
  const T fresh = max_of(T(0), at_start - at_end);
  const T push = min_of(gap - at_end, fresh + rule.old_overlap);
  const Vec3<T> slip = (now - before) - dot(now - before, n) * n;
  const T size = norm(slip);
  const T most = rule.friction * push;
  const Vec3<T> hold = size > most ? (-most / size) * slip : -slip;
  const Vec3<T> change = push * n + hold;
  for (int k = 0; k < 4; ++k) {
    out.correction[k] = (pair.weight[k] * x[k].w / weight) * change;
  }
  out.active = true;
  return out;
}

/// How much a particle that lies on the body yields to other cloth: hardly, so that what lies on it
/// moves instead and is not pushed through.
template <class T>
ATELIER_HOST_DEVICE inline Vec4<T> supported(const Vec4<T>& x, bool touches_body) {
  return with_w(xyz(x), touches_body ? T(0.01) * x.w : x.w);
}

/// Fixed-point unit of the sums.
constexpr double kPushUnit = 1.0 / (1 << 30);
template <class T>
ATELIER_HOST_DEVICE inline int to_units(T metres) {
  constexpr T kMost = T(0.03);  // 64 of them fit
  const T limited = metres > kMost ? kMost : metres < -kMost ? -kMost : metres;
  return static_cast<int>(std::floor(limited * static_cast<T>(1 << 30) + T(0.5)));
}

/// Sum of what pairs want of one particle.
struct PushSum {
  int x, y, z, count;
};

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> mean_push(const PushSum& sum) {
  const T unit = static_cast<T>(kPushUnit) / static_cast<T>(sum.count > 0 ? sum.count : 1);
  return {static_cast<T>(sum.x) * unit, static_cast<T>(sum.y) * unit, static_cast<T>(sum.z) * unit};
}

template <class T>
ATELIER_HOST_DEVICE inline bool same_layer(const SelfView<T>& cloth, int first, int second) {
  return cloth.layer == nullptr || cloth.layer[first] == cloth.layer[second];
}

/// Direction in which the first point of a pair between layers must lie, seen from the face.
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> layer_direction(const SelfView<T>& cloth, int first, int second,
                                                   Vec3<T> normal) {
  if (same_layer(cloth, first, second)) {
    return {};
  }
  return cloth.layer[first] > cloth.layer[second] ? normal : -normal;
}

/// Calls `load(i)` -> x and `load_start(i)` for the four particles and returns the push of particle
/// `i` against `face`.
template <class T, class Load, class LoadStart, class Add>
ATELIER_HOST_DEVICE inline bool push_vertex_face(const SelfView<T>& cloth, int i,
                                                 SelfPair<T> candidate, const SelfRule<T>& rule,
                                                 const Load& load, const LoadStart& load_start,
                                                 const Add& add) {
  const FaceIndices f = cloth.surface.faces[candidate.other];
  if (same_layer(cloth, i, f.a) && cloth.tangled[i] != 0 &&
      (cloth.tangled[f.a] | cloth.tangled[f.b] | cloth.tangled[f.c]) != 0) {
    return false;
  }
  const Vec4<T> start[4] = {load_start(i), load_start(f.a), load_start(f.b), load_start(f.c)};
  const FaceCorners<T> t{xyz(start[1]), xyz(start[2]), xyz(start[3])};
  const Vec3<T> b = nearest_on_triangle(xyz(start[0]), t);
  PairPoints<T> pair{{i, f.a, f.b, f.c}, {T(1), -b.x, -b.y, -b.z}};
  Vec3<T> normal = cross(t.b - t.a, t.c - t.a);
  const T size = norm(normal);
  normal = size > T(0) ? (T(1) / size) * normal : normal;
  const Vec4<T> x[4] = {load(i), load(f.a), load(f.b), load(f.c)};
  const PairPush<T> push = push_apart(pair, x, start, normal,
                                      layer_direction(cloth, i, f.a, normal), candidate.gap, rule);
  if (push.active) {
    for (int k = 0; k < 4; ++k) {
      add(pair.particle[k], push.correction[k]);
    }
  }
  return push.active;
}

template <class T, class Load, class LoadStart, class Add>
ATELIER_HOST_DEVICE inline bool push_edge_edge(const SelfView<T>& cloth, int e,
                                               SelfPair<T> candidate, const SelfRule<T>& rule,
                                               const Load& load, const LoadStart& load_start,
                                               const Add& add) {
  const ClothEdge a = cloth.edges[e];
  const ClothEdge b = cloth.edges[candidate.other];
  if (same_layer(cloth, a.a, b.a) && (cloth.tangled[a.a] | cloth.tangled[a.b]) != 0 &&
      (cloth.tangled[b.a] | cloth.tangled[b.b]) != 0) {
    return false;
  }
  const Vec4<T> start[4] = {load_start(a.a), load_start(a.b), load_start(b.a), load_start(b.b)};
  const SegmentShares<T> near =
      nearest_on_segments(xyz(start[0]), xyz(start[1]), xyz(start[2]), xyz(start[3]));
  // At an end it is the vertex that meets something, and its own pairs see to that.
  if (!(near.s > T(0) && near.s < T(1) && near.t > T(0) && near.t < T(1))) {
    return false;
  }
  PairPoints<T> pair{{a.a, a.b, b.a, b.b}, {T(1) - near.s, near.s, near.t - T(1), -near.t}};
  Vec3<T> normal{};
  if (cloth.layer != nullptr && cloth.layer[a.a] != cloth.layer[b.a]) {
    const FaceIndices f = cloth.surface.faces[b.face[0]];
    const Vec3<T> fa = xyz(load_start(f.a));
    normal = cross(xyz(load_start(f.b)) - fa, xyz(load_start(f.c)) - fa);
    const T size = norm(normal);
    normal = size > T(0) ? (T(1) / size) * normal : normal;
  }
  const Vec4<T> x[4] = {load(a.a), load(a.b), load(b.a), load(b.b)};
  const PairPush<T> push = push_apart(
      pair, x, start, normal, layer_direction(cloth, a.a, b.a, normal), candidate.gap, rule);
  if (push.active) {
    for (int k = 0; k < 4; ++k) {
      add(pair.particle[k], push.correction[k]);
    }
  }
  return push.active;
}

/// Pulls an edge out of a face that it passes through: along the gradient that shortens the line in
/// which its faces meet the other one.
template <class T, class Load, class Add>
ATELIER_HOST_DEVICE inline bool pull_out(const SelfView<T>& cloth, int e, int face,
                                         const SelfRule<T>& rule, const Load& load,
                                         const Add& add) {
  const ClothEdge edge = cloth.edges[e];
  const FaceIndices f = cloth.surface.faces[face];
  const Vec4<T> p4 = load(edge.a);
  const Vec4<T> q4 = load(edge.b);
  const Vec4<T> a4 = load(f.a);
  const Vec4<T> b4 = load(f.b);
  const Vec4<T> c4 = load(f.c);
  const Vec3<T> p = xyz(p4);
  const Vec3<T> q = xyz(q4);
  const FaceCorners<T> t{xyz(a4), xyz(b4), xyz(c4)};
  if (!crosses(p, q, t)) {
    return false;
  }
  Vec3<T> n = cross(t.b - t.a, t.c - t.a);
  const T nn = squared_norm(n);
  if (!(nn > T(0))) {
    return false;
  }
  n = (T(1) / std::sqrt(nn)) * n;
  const Vec3<T> along = q - p;
  const T length = norm(along);
  const Vec3<T> direction = (T(1) / length) * along;
  const T rise = dot(direction, n);
  Vec3<T> gradient{};
  for (int k = 0; k < 2; ++k) {
    if (edge.face[k] < 0) {
      continue;
    }
    const Vec3<T> inwards = xyz(load(edge.opposite[k])) - p;
    Vec3<T> line = cross(n, cross(along, inwards));
    const T size = norm(line);
    if (!(size > T(0))) {
      continue;
    }
    line = (T(1) / size) * line;
    if (dot(line, inwards - dot(inwards, direction) * direction) < T(0)) {
      line = -line;
    }
    gradient += line;
    if (std::fabs(rise) > T(0.05)) {
      gradient -= (dot(direction, line) / rise) * n;
    }
  }
  const T size = norm(gradient);
  if (!(size > T(1e-3))) {
    return false;
  }
  const Vec3<T> pull = (rule.untangle / size) * gradient;
  const T share = dot(n, t.a - p) / dot(n, along);
  add(edge.a, (p4.w > T(0) ? (T(1) - share) : T(0)) * pull);
  add(edge.b, (q4.w > T(0) ? share : T(0)) * pull);
  const Vec3<T> back = T(-1.0 / 3) * pull;
  add(f.a, (a4.w > T(0) ? T(1) : T(0)) * back);
  add(f.b, (b4.w > T(0) ? T(1) : T(0)) * back);
  add(f.c, (c4.w > T(0) ? T(1) : T(0)) * back);
  return true;
}

}  // namespace atelier
