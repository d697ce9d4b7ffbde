#pragma once

#include <cmath>

#include "simulation/cloth/vec4.h"
#include "simulation/contact/tree_math.h"

namespace atelier {

/// Corners of one triangle.
template <class T>
struct FaceCorners {
  Vec3<T> a, b, c;
};

struct FaceIndices {
  int a, b, c;
};

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> weighted(const FaceCorners<T>& t, Vec3<T> barycentric) {
  return barycentric.x * t.a + barycentric.y * t.b + barycentric.z * t.c;
}

/// Barycentric coordinates of the point of a triangle that is nearest to `p` (Ericson 2005,
/// "Real-time collision detection", 5.1.5).
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> nearest_on_triangle(Vec3<T> p, const FaceCorners<T>& t) {
  const Vec3<T> ab = t.b - t.a;
  const Vec3<T> ac = t.c - t.a;
  const Vec3<T> ap = p - t.a;
  const T d1 = dot(ab, ap);
  const T d2 = dot(ac, ap);
  if (d1 <= T(0) && d2 <= T(0)) {
    return {T(1), T(0), T(0)};
  }
  const Vec3<T> bp = p - t.b;
  const T d3 = dot(ab, bp);
  const T d4 = dot(ac, bp);
  if (d3 >= T(0) && d4 <= d3) {
    return {T(0), T(1), T(0)};
  }
  const T vc = d1 * d4 - d3 * d2;
  if (vc <= T(0) && d1 >= T(0) && d3 <= T(0)) {
    const T v = d1 - d3 > T(0) ? d1 / (d1 - d3) : T(0);
    return {T(1) - v, v, T(0)};
  }
  const Vec3<T> cp = p - t.c;
  const T d5 = dot(ab, cp);
  const T d6 = dot(ac, cp);
  if (d6 >= T(0) && d5 <= d6) {
    return {T(0), T(0), T(1)};
  }
  const T vb = d5 * d2 - d1 * d6;
  if (vb <= T(0) && d2 >= T(0) && d6 <= T(0)) {
    const T w = d2 - d6 > T(0) ? d2 / (d2 - d6) : T(0);
    return {T(1) - w, T(0), w};
  }
  const T va = d3 * d6 - d5 * d4;
  if (va <= T(0) && d4 - d3 >= T(0) && d5 - d6 >= T(0)) {
    const T span = (d4 - d3) + (d5 - d6);
    const T w = span > T(0) ? (d4 - d3) / span : T(0);
    return {T(0), T(1) - w, w};
  }
  const T sum = va + vb + vc;
  if (!(sum > T(0))) {
    return {T(1), T(0), T(0)};
  }
  return {va / sum, vb / sum, vc / sum};
}

/// Boxes over faces that lie together: over each, over each 32 that follow one another and over
/// each 32 of these. Missing ones at the end have empty boxes.
template <class T>
struct FaceBoxes {
  const int* face = nullptr;
  const Box<T>* box = nullptr;
  const Box<T>* group = nullptr;
  const Box<T>* whole = nullptr;
  int wholes = 0;
};

/// The body during one frame: its vertices move linearly from `start` to `end`. The boxes of the
/// tree cover the whole motion.
template <class T>
struct BodyView {
  const FaceIndices* faces;
  const Vec4<T>* start;
  const Vec4<T>* end;
  const BoxNode<T>* nodes;
  int face_count;        ///< 0: no body
  FaceBoxes<T> boxes{};  ///< for teams of threads (CUDA)
};

template <class T>
ATELIER_HOST_DEVICE inline FaceCorners<T> corners_at(const BodyView<T>& body, int face, T time) {
  const FaceIndices f = body.faces[face];
  const auto at = [&](int v) {
    const Vec3<T> s = xyz(body.start[v]);
    return s + time * (xyz(body.end[v]) - s);
  };
  return {at(f.a), at(f.b), at(f.c)};
}

template <class T>
ATELIER_HOST_DEVICE inline Box<T> swept_box(const BodyView<T>& body, int face) {
  const FaceIndices f = body.faces[face];
  Box<T> box = empty_box<T>();
  for (int v : {f.a, f.b, f.c}) {
    grow(box, xyz(body.start[v]));
    grow(box, xyz(body.end[v]));
  }
  return box;
}

/// Time in [0, 1] at which a particle moving from `p0` to `p1` passes from the outside through a
/// moving triangle, or a value above 1. The cubic is solved by regula falsi between its signs.
template <class T>
ATELIER_HOST_DEVICE inline T crossing_time(Vec3<T> p0, Vec3<T> p1, const FaceCorners<T>& t0,
                                           const FaceCorners<T>& t1, Vec3<T>& barycentric) {
  const T never = T(2);
  const auto height = [](Vec3<T> p, const FaceCorners<T>& t) {
    return dot(cross(t.b - t.a, t.c - t.a), p - t.a);
  };
  T low = T(0);
  T high = T(1);
  T at_low = height(p0, t0);
  T at_high = height(p1, t1);
  if (at_low < T(0) || at_high >= T(0)) {
    return never;
  }
  T time = T(0);
  FaceCorners<T> t = t0;
  Vec3<T> p = p0;
  for (int i = 0; i < 4; ++i) {
    time = low + (high - low) * (at_low / (at_low - at_high));
    t = {t0.a + time * (t1.a - t0.a), t0.b + time * (t1.b - t0.b), t0.c + time * (t1.c - t0.c)};
    p = p0 + time * (p1 - p0);
    const T value = height(p, t);
    if (value >= T(0)) {
      low = time;
      at_low = value;
    } else {
      high = time;
      at_high = value;
    }
    if (!(at_low - at_high > T(0))) {
      break;
    }
  }
  const Vec3<T> n = cross(t.b - t.a, t.c - t.a);
  const T nn = squared_norm(n);
  if (!(nn > T(0))) {
    return never;
  }
  const T v = dot(n, cross(p - t.a, t.c - t.a)) / nn;
  const T w = dot(n, cross(t.b - t.a, p - t.a)) / nn;
  const T slack = T(1e-4);
  if (v < -slack || w < -slack || v + w > T(1) + slack) {
    return never;
  }
  barycentric = {T(1) - v - w, v, w};
  return time;
}

/// Relation of a face to a particle: distance, side, and when it was passed in the substep.
template <class T>
struct FaceOffer {
  int face;  ///< -1: none
  T squared_distance;
  T side;               ///< signed distance to its plane
  Vec3<T> barycentric;  ///< of the nearest point
  T time;               ///< of passing through from the outside, above 1: never
  Vec3<T> hit;          ///< barycentric, where it passed
};

template <class T>
ATELIER_HOST_DEVICE inline FaceOffer<T> no_offer(T reach) {
  return {-1, reach * reach, T(0), {}, T(2), {}};
}

/// How a particle moves: from `p0` at time t0 of the frame to `p1` at t1.
template <class T>
struct Passage {
  Vec3<T> p0, p1;
  T t0, t1;
};
/// One that stays at `x`, at one time.
template <class T>
ATELIER_HOST_DEVICE inline Passage<T> standing(Vec3<T> x, T time) {
  return {x, x, time, time};
}

/// The offer of `face` to a particle; `swept`: also whether it passed through it.
template <class T>
ATELIER_HOST_DEVICE inline FaceOffer<T> offer_of(const BodyView<T>& body, int face,
                                                 const Passage<T>& way, bool swept) {
  const Vec3<T> p1 = way.p1;
  const FaceCorners<T> t = corners_at(body, face, way.t1);
  FaceOffer<T> out = no_offer(T(1e15));
  const Vec3<T> n = cross(t.b - t.a, t.c - t.a);
  const T nn = squared_norm(n);
  if (!(nn > T(0))) {
    return out;
  }
  out.face = face;
  out.barycentric = nearest_on_triangle(p1, t);
  out.squared_distance = squared_norm(p1 - weighted(t, out.barycentric));
  out.side = dot(n, p1 - t.a) / std::sqrt(nn);
  // Only what ends behind the plane can have passed it.
  if (swept && out.side < T(0)) {
    out.time = crossing_time(way.p0, p1, corners_at(body, face, way.t0), t, out.hit);
  }
  return out;
}

/// Two faces are as near when they share the nearest edge or corner; then the one whose plane is
/// further away knows the side.
template <class T>
ATELIER_HOST_DEVICE inline T as_near(T squared_distance) {
  return squared_distance * T(1.00001) + T(1e-20);
}

/// Nearest face and first face passed.
template <class T>
struct FaceChoice {
  FaceOffer<T> nearest, first;
};

/// True where `a` is passed through before `b`; of two at once the lower face, so that the choice
/// does not depend on the order in which faces come (trees differ, as they were built in other
/// poses).
template <class T>
ATELIER_HOST_DEVICE inline bool passed_before(const FaceOffer<T>& a, const FaceOffer<T>& b) {
  return a.time < b.time || (a.time == b.time && a.time <= T(1) && a.face < b.face);
}

/// True where `a`, of two that are as near, knows the side better than `b`.
template <class T>
ATELIER_HOST_DEVICE inline bool knows_side_better(const FaceOffer<T>& a, const FaceOffer<T>& b) {
  const T sa = std::fabs(a.side);
  const T sb = std::fabs(b.side);
  return b.face < 0 || sa > sb || (sa == sb && a.face < b.face);
}

/// A face and how near it is; -1: none.
template <class T>
struct NearFace {
  T squared_distance;
  int face;
};

/// True where `a` is nearer than `b`; of two as near the lower face.
template <class T>
ATELIER_HOST_DEVICE inline bool is_nearer(const NearFace<T>& a, const NearFace<T>& b) {
  return a.squared_distance < b.squared_distance ||
         (a.squared_distance == b.squared_distance && a.face >= 0 && a.face < b.face);
}

/// Of the faces that are `near` (squared) to `x`, as near as the nearest, the one that knows the
/// side best. -1 where rounding leaves none: what is asked for was computed elsewhere.
template <class T, class Team>
ATELIER_HOST_DEVICE inline int face_that_knows_the_side(const BodyView<T>& body, Vec3<T> x, T time,
                                                        T near, const Team& team) {
  struct Side {
    T size;
    int face;
  };
  const auto better = [](const Side& a, const Side& b) {
    return a.size > b.size || (a.size == b.size && a.face < b.face);
  };
  Side best{T(-1), -1};
  // A face's nearest point is rounded as its coordinates are; its box is not.
  const T size = max_of(std::fabs(x.x), max_of(std::fabs(x.y), std::fabs(x.z)));
  const Box<T> close = inflated(Box<T>{x, x}, std::sqrt(near) * T(1.00001) + size * T(1e-6));
  team.visit(body, close, [&](int face) {
    const FaceOffer<T> offer = offer_of(body, face, standing(x, time), false);
    const Side side{std::fabs(offer.side), offer.face};
    if (offer.face >= 0 && offer.squared_distance <= near && better(side, best)) {
      best = side;
    }
  });
  return team.best(best, better).face;
}

/// The nearest face within `reach` of the end of the way (which must lie in `query`) and, where
/// `swept`, the first face passed on it, among those that meet `query`.
template <class T, class Team>
ATELIER_HOST_DEVICE inline FaceChoice<T> choose_in_tree(const BodyView<T>& body,
                                                        const Box<T>& query, const Passage<T>& way,
                                                        T reach, bool swept, const Team& team) {
  struct Passed {
    T time;
    int face;
  };
  const auto before = [](const Passed& a, const Passed& b) {
    return a.time < b.time || (a.time == b.time && a.time <= T(1) && a.face < b.face);
  };
  FaceChoice<T> choice{no_offer(reach), no_offer(reach)};
  Passed first{T(2), -1};
  NearFace<T> nearest{T(2) * reach * reach, -1};
  team.visit(body, query, [&](int face) {
    const FaceOffer<T> offer = offer_of(body, face, way, swept);
    const Passed passed{offer.time, offer.face};
    if (before(passed, first)) {
      first = passed;
    }
    const NearFace<T> near{offer.squared_distance, offer.face};
    if (offer.face >= 0 && is_nearer(near, nearest)) {
      nearest = near;
    }
  });
  first = team.best(first, before);
  if (first.time <= T(1)) {
    choice.first = offer_of(body, first.face, way, swept);
    return choice;
  }
  nearest = team.best(nearest,
                      [](const NearFace<T>& a, const NearFace<T>& b) { return is_nearer(a, b); });
  if (nearest.squared_distance <= reach * reach) {
    const T near = as_near(nearest.squared_distance);
    const int face = face_that_knows_the_side(body, way.p1, way.t1, near, team);
    choice.nearest = offer_of(body, face >= 0 ? face : nearest.face, way, false);
  }
  return choice;
}

/// How often the body lies round `x` at `time` of the frame: 0 outside, 1 inside, 2 where it
/// overlaps itself. Passes through the surface of a ray along +x; a ray through an edge passes one
/// of its faces, by the order of its ends. Meaningless for open surfaces.
template <class T, class Team>
ATELIER_HOST_DEVICE inline int times_inside(const BodyView<T>& body, Vec3<T> x, T time,
                                            const Team& team) {
  Box<T> ray{x, x};
  ray.high.x = T(1e30);
  int times = 0;
  team.visit(body, ray, [&](int face) {
    const FaceIndices f = body.faces[face];
    const FaceCorners<T> t = corners_at(body, face, time);
    const auto left = [&](Vec3<T> a, Vec3<T> b, int from, int to) {
      const T area = (a.y - x.y) * (b.z - x.z) - (a.z - x.z) * (b.y - x.y);
      return area > T(0) || (area == T(0) && from < to);
    };
    const bool ab = left(t.a, t.b, f.a, f.b);
    if (ab != left(t.b, t.c, f.b, f.c) || ab != left(t.c, t.a, f.c, f.a)) {
      return;
    }
    const Vec3<T> n = cross(t.b - t.a, t.c - t.a);
    if ((dot(n, t.a - x) > T(0)) == (n.x > T(0))) {
      times += ab ? 1 : -1;
    }
  });
  return team.sum(times);
}

/// The nearest face within `reach` of `x` that `x` lies behind.
template <class T, class Team>
ATELIER_HOST_DEVICE inline FaceOffer<T> nearest_way_out(const BodyView<T>& body, Vec3<T> x, T time,
                                                        T reach, const Team& team) {
  NearFace<T> best{reach * reach, -1};
  team.visit(body, inflated(Box<T>{x, x}, reach), [&](int face) {
    const FaceOffer<T> offer = offer_of(body, face, standing(x, time), false);
    const NearFace<T> near{offer.squared_distance, offer.face};
    if (offer.face >= 0 && offer.side < T(0) && is_nearer(near, best)) {
      best = near;
    }
  });
  best =
      team.best(best, [](const NearFace<T>& a, const NearFace<T>& b) { return is_nearer(a, b); });
  return best.face >= 0 ? offer_of(body, best.face, standing(x, time), false) : no_offer(reach);
}

}  // namespace atelier
